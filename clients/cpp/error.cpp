#include "clients/cpp/error.h"

#include <utility>

namespace limber::client {

ClientError::ClientError(v1::ErrorCode code, std::string field, const std::string& message,
                         std::map<std::string, std::string> details)
    : std::runtime_error(message),
      code_(code),
      field_(std::move(field)),
      details_(std::move(details)) {}

ClientError::ClientError(const v1::Error& error)
    : ClientError(error.code(), error.field(), error.message(),
                  {error.details().begin(), error.details().end()}) {}

std::string ClientError::code_name() const {
  const std::string prefix = "ERROR_CODE_";
  const std::string& name = v1::ErrorCode_Name(code_);
  if (name.empty()) return std::to_string(code_);
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

void throw_refusal(const v1::Error& error) {
  if (error.code() == v1::ERROR_CODE_RESTARTED) throw ServerRestarted(error);
  if (error.code() == v1::ERROR_CODE_SHUTTING_DOWN) throw ServerStopped(error);
  throw ClientError(error);
}

bool is_for_next_run(const ClientError& error) {
  const auto detail = error.details().find("send_again");
  return error.code() == v1::ERROR_CODE_SHUTTING_DOWN && detail != error.details().end() &&
         detail->second == "true";
}

Unreachable::Unreachable(const std::string& message)
    : ClientError(v1::ERROR_CODE_TIMEOUT, "", message) {}

}  // namespace limber::client
