#pragma once

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>

#include "engine/base/error.h"
#include "limber/v1/common.pb.h"

namespace limber::server {

namespace proto = limber::v1;
using Details = std::map<std::string, std::string>;

/// A request is refused for a reason only the service knows (limits, time, shutdown, unreadable
/// bytes), or with details. Errors of the engine are limber::Error; both become the same message on
/// the wire.
class Refusal : public std::runtime_error {
 public:
  Refusal(proto::ErrorCode code, std::string field, const std::string& message,
          Details details = {})
      : std::runtime_error(whole_text(message)),
        code_(code),
        field_(std::move(field)),
        details_(std::move(details)) {}
  [[nodiscard]] proto::ErrorCode code() const noexcept { return code_; }
  [[nodiscard]] const std::string& field() const noexcept { return field_; }
  [[nodiscard]] const Details& details() const noexcept { return details_; }

 private:
  proto::ErrorCode code_;
  std::string field_;
  Details details_;
};

[[nodiscard]] Refusal invalid(const std::string& field, const std::string& message);
[[nodiscard]] Refusal malformed(const std::string& message);
/// Whether another run of the server will know the outcome of a request.
enum class NextRun { kUnknown, kTakesOver };
[[nodiscard]] Refusal shutting_down(NextRun next = NextRun::kUnknown,
                                    const std::string& message = "the server is going down");
/// "`what` is V, the limit is L", with details {limit, value}.
[[nodiscard]] Refusal limit_exceeded(const std::string& field, const std::string& what,
                                     std::uint64_t limit, std::uint64_t value);

[[nodiscard]] proto::ErrorCode to_proto(ErrorCode code);

/// Any exception as the message that answers it. Exceptions of other types are kInternal.
/// @param prefix  put before a field that the engine named, e.g. "scene."
[[nodiscard]] proto::Error error_to_proto(const std::exception& fault,
                                          const std::string& prefix = "");

}  // namespace limber::server
