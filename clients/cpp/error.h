#pragma once

#include <map>
#include <stdexcept>
#include <string>

#include "limber/v1/common.pb.h"

namespace limber::client {

/// A refused request, or one that this client refuses to send.
class ClientError : public std::runtime_error {
 public:
  ClientError(v1::ErrorCode code, std::string field, const std::string& message,
              std::map<std::string, std::string> details = {});
  explicit ClientError(const v1::Error& error);

  [[nodiscard]] v1::ErrorCode code() const { return code_; }
  /// "OUT_OF_RANGE" for ERROR_CODE_OUT_OF_RANGE.
  [[nodiscard]] std::string code_name() const;
  /// Path of the offending field in the request, e.g. "edits[0].add.constraint.frame"; empty if
  /// none applies.
  [[nodiscard]] const std::string& field() const { return field_; }
  [[nodiscard]] const std::map<std::string, std::string>& details() const { return details_; }

 private:
  v1::ErrorCode code_;
  std::string field_;
  std::map<std::string, std::string> details_;
};

/// limberd was restarted: the requested session or job is gone, even if another has its name now.
/// Code RESTARTED.
class ServerRestarted : public ClientError {
 public:
  using ClientError::ClientError;
};

/// @throws what a client makes of an error of the server: ServerRestarted, ServerStopped, else
/// ClientError
[[noreturn]] void throw_refusal(const v1::Error& error);

/// Nothing answers at the endpoint, or the answer did not come in time. Code TIMEOUT.
class Unreachable : public ClientError {
 public:
  explicit Unreachable(const std::string& message);

 protected:
  using ClientError::ClientError;
};

/// limberd was stopped in order, and said so. Code SHUTTING_DOWN.
class ServerStopped : public Unreachable {
 public:
  explicit ServerStopped(const v1::Error& error) : Unreachable(error) {}
  explicit ServerStopped(const std::string& message)
      : Unreachable(v1::ERROR_CODE_SHUTTING_DOWN, "", message) {}
};

/// Refused by a server at its end, which another run of it follows: the request was not executed,
/// and may be sent to that run.
[[nodiscard]] bool is_for_next_run(const ClientError& error);

}  // namespace limber::client
