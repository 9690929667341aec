#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "engine/base/error.h"

namespace limber::session {

/// An edit would pass a limit, which the client may be told in numbers.
class LimitError : public Error {
 public:
  LimitError(std::string field, const std::string& message, std::uint64_t limit,
             std::uint64_t value)
      : Error(ErrorCode::kLimitExceeded, std::move(field), message), limit_(limit), value_(value) {}
  [[nodiscard]] std::uint64_t limit() const noexcept { return limit_; }
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t limit_, value_;
};

/// Throws the same error at another field.
[[noreturn]] inline void rethrow_at(const Error& error, const std::string& field) {
  if (const auto* limit = dynamic_cast<const LimitError*>(&error))
    throw LimitError(field, error.what(), limit->limit(), limit->value());
  throw Error(error.code(), field, error.what());
}

}  // namespace limber::session
