#include "tests/support/printing/print.h"

#include <ostream>

#include "engine/base/error.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/session.h"
#include "engine/spacetime/problem.h"
#include "engine/spacetime/solver.h"

// Numbers that are no enumerator are printed as such.
#define LIMBER_NAME(enumerator) \
  case enumerator:              \
    *out << #enumerator;        \
    return

namespace limber {
void PrintTo(ErrorCode code, std::ostream* out) {
  switch (code) {
    LIMBER_NAME(ErrorCode::kInvalidArgument);
    LIMBER_NAME(ErrorCode::kOutOfRange);
    LIMBER_NAME(ErrorCode::kNotFound);
    LIMBER_NAME(ErrorCode::kAlreadyExists);
    LIMBER_NAME(ErrorCode::kUnsupported);
    LIMBER_NAME(ErrorCode::kLimitExceeded);
    LIMBER_NAME(ErrorCode::kFailedPrecondition);
    LIMBER_NAME(ErrorCode::kCancelled);
    LIMBER_NAME(ErrorCode::kIo);
    LIMBER_NAME(ErrorCode::kNumerical);
    LIMBER_NAME(ErrorCode::kInternal);
  }
  *out << "ErrorCode(" << static_cast<int>(code) << ")";
}
}  // namespace limber

namespace limber::reduced {
void PrintTo(CubatureKind kind, std::ostream* out) {
  switch (kind) {
    LIMBER_NAME(CubatureKind::kFittedMaps);
    LIMBER_NAME(CubatureKind::kWeights);
  }
  *out << "CubatureKind(" << static_cast<int>(kind) << ")";
}
}  // namespace limber::reduced

namespace limber::spacetime {
void PrintTo(EndCondition end, std::ostream* out) {
  switch (end) {
    LIMBER_NAME(EndCondition::kFree);
    LIMBER_NAME(EndCondition::kPinnedPosition);
    LIMBER_NAME(EndCondition::kPinnedPositionVelocity);
    LIMBER_NAME(EndCondition::kCyclic);
  }
  *out << "EndCondition(" << static_cast<int>(end) << ")";
}

void PrintTo(SolveStatus status, std::ostream* out) {
  switch (status) {
    LIMBER_NAME(SolveStatus::kConverged);
    LIMBER_NAME(SolveStatus::kImproved);
    LIMBER_NAME(SolveStatus::kIterationLimit);
    LIMBER_NAME(SolveStatus::kStalled);
    LIMBER_NAME(SolveStatus::kCancelled);
  }
  *out << "SolveStatus(" << static_cast<int>(status) << ")";
}
}  // namespace limber::spacetime

namespace limber::scene {
void PrintTo(End end, std::ostream* out) {
  switch (end) {
    LIMBER_NAME(End::kFree);
    LIMBER_NAME(End::kPinnedPosition);
    LIMBER_NAME(End::kPinnedPositionVelocity);
    LIMBER_NAME(End::kCyclic);
  }
  *out << "End(" << static_cast<int>(end) << ")";
}

void PrintTo(TargetKind kind, std::ostream* out) {
  switch (kind) {
    LIMBER_NAME(TargetKind::kDisplacement);
    LIMBER_NAME(TargetKind::kPosition);
    LIMBER_NAME(TargetKind::kVelocity);
  }
  *out << "TargetKind(" << static_cast<int>(kind) << ")";
}
}  // namespace limber::scene

namespace limber::session {
void PrintTo(State state, std::ostream* out) {
  switch (state) {
    LIMBER_NAME(State::kBuilding);
    LIMBER_NAME(State::kReady);
    LIMBER_NAME(State::kFailed);
    LIMBER_NAME(State::kClosed);
  }
  *out << "State(" << static_cast<int>(state) << ")";
}
}  // namespace limber::session
