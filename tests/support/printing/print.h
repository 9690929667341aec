#pragma once

#include <iosfwd>

// What GoogleTest writes for our enums in place of their bytes. limber_test() includes this file
// before everything else: all translation units of a program must print alike, or the linker
// chooses between them.
namespace limber {
enum class ErrorCode;
void PrintTo(ErrorCode code, std::ostream* out);
}  // namespace limber

namespace limber::reduced {
enum class CubatureKind;
void PrintTo(CubatureKind kind, std::ostream* out);
}  // namespace limber::reduced

namespace limber::spacetime {
enum class EndCondition;
enum class SolveStatus;
void PrintTo(EndCondition end, std::ostream* out);
void PrintTo(SolveStatus status, std::ostream* out);
}  // namespace limber::spacetime

namespace limber::scene {
enum class End;
enum class TargetKind;
void PrintTo(End end, std::ostream* out);
void PrintTo(TargetKind kind, std::ostream* out);
}  // namespace limber::scene

namespace limber::session {
enum class State;
void PrintTo(State state, std::ostream* out);
}  // namespace limber::session
