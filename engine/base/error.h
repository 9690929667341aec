#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace limber {

/// The closed list of reasons a caller's input or request can be refused. Outcomes of solvers are
/// reports, not errors.
enum class ErrorCode {
  kInvalidArgument,     // a value is malformed: NaN, wrong size, negative where positive is needed
  kOutOfRange,          // an index or id outside its range
  kNotFound,            // a named thing does not exist
  kAlreadyExists,       // a name or id is taken
  kUnsupported,         // a format, version or feature this build does not have
  kLimitExceeded,       // a configured limit would be passed
  kFailedPrecondition,  // right request, wrong moment
  kCancelled,           // the caller asked to stop
  kIo,                  // a file could not be read or written
  kNumerical,           // the numbers do not allow an answer (singular where it must not be)
  kInternal,            // a fault of ours
};

[[nodiscard]] const char* to_string(ErrorCode code) noexcept;

/// Text that what() gives whole. A name that a message quotes may have zero bytes, at which what()
/// would end; they become '?'.
[[nodiscard]] std::string whole_text(std::string text);

/// Bad input, described so that the caller can correct it: which field, which value, which rule.
class Error : public std::runtime_error {
 public:
  /// @param field  path of the offending value in the caller's terms, e.g. "mesh.tets[17]"; empty
  /// if none applies
  Error(ErrorCode code, std::string field, const std::string& message)
      : std::runtime_error(whole_text(message)), code_(code), field_(std::move(field)) {}
  [[nodiscard]] ErrorCode code() const noexcept { return code_; }
  [[nodiscard]] const std::string& field() const noexcept { return field_; }

 private:
  ErrorCode code_;
  std::string field_;
};

namespace detail {
[[noreturn]] void demand_failed(const char* condition, const char* file, int line);
}  // namespace detail

}  // namespace limber

/// An invariant of ours; its failure is a bug here, never the caller's. Active in every build type.
#define LIMBER_DEMAND(condition)      \
  ((condition) ? static_cast<void>(0) \
               : ::limber::detail::demand_failed(#condition, __FILE__, __LINE__))
