#include "server/wire/errors.h"

#include <fmt/format.h>

#include <new>
#include <utility>

#include "engine/session/core/limit_error.h"
#include "server/wire/enum_table.h"
#include "server/wire/readable.h"

namespace limber::server {

Refusal invalid(const std::string& field, const std::string& message) {
  return {proto::ERROR_CODE_INVALID_ARGUMENT, field, message};
}

Refusal malformed(const std::string& message) { return {proto::ERROR_CODE_MALFORMED, "", message}; }

Refusal shutting_down(NextRun next, const std::string& message) {
  Details details;
  if (next == NextRun::kTakesOver) details["send_again"] = "true";
  return {proto::ERROR_CODE_SHUTTING_DOWN, "", message, std::move(details)};
}

Refusal limit_exceeded(const std::string& field, const std::string& what, std::uint64_t limit,
                       std::uint64_t value) {
  return {proto::ERROR_CODE_LIMIT_EXCEEDED,
          field,
          fmt::format("{} {}: more than the limit of {}", value, what, limit),
          {{"limit", std::to_string(limit)}, {"value", std::to_string(value)}}};
}

constexpr EnumTable<ErrorCode, proto::ErrorCode> kErrorCodes{
    {ErrorCode::kInvalidArgument, proto::ERROR_CODE_INVALID_ARGUMENT},
    {ErrorCode::kOutOfRange, proto::ERROR_CODE_OUT_OF_RANGE},
    {ErrorCode::kNotFound, proto::ERROR_CODE_NOT_FOUND},
    {ErrorCode::kAlreadyExists, proto::ERROR_CODE_ALREADY_EXISTS},
    {ErrorCode::kUnsupported, proto::ERROR_CODE_UNSUPPORTED},
    {ErrorCode::kLimitExceeded, proto::ERROR_CODE_LIMIT_EXCEEDED},
    {ErrorCode::kFailedPrecondition, proto::ERROR_CODE_FAILED_PRECONDITION},
    {ErrorCode::kCancelled, proto::ERROR_CODE_CANCELLED},
    {ErrorCode::kIo, proto::ERROR_CODE_IO},
    {ErrorCode::kNumerical, proto::ERROR_CODE_NUMERICAL},
    {ErrorCode::kInternal, proto::ERROR_CODE_INTERNAL}};

proto::ErrorCode to_proto(ErrorCode code) { return kErrorCodes.encode(code); }

proto::Error error_to_proto(const std::exception& fault, const std::string& prefix) {
  proto::Error error;
  if (const auto* refusal = dynamic_cast<const Refusal*>(&fault)) {
    error.set_code(refusal->code());
    error.set_field(field_text(refusal->field()));
    for (const auto& [key, value] : refusal->details())
      (*error.mutable_details())[key] = field_text(value);
  } else if (const auto* engine = dynamic_cast<const Error*>(&fault)) {
    error.set_code(to_proto(engine->code()));
    if (!engine->field().empty()) error.set_field(field_text(prefix + engine->field()));
    if (const auto* limit = dynamic_cast<const session::LimitError*>(engine)) {
      (*error.mutable_details())["limit"] = std::to_string(limit->limit());
      (*error.mutable_details())["value"] = std::to_string(limit->value());
    }
  } else if (dynamic_cast<const std::bad_alloc*>(&fault) != nullptr) {
    error.set_code(proto::ERROR_CODE_LIMIT_EXCEEDED);
    error.set_message("out of memory");
    return error;
  } else {
    error.set_code(proto::ERROR_CODE_INTERNAL);
  }
  error.set_message(message_text(fault.what()));
  return error;
}

}  // namespace limber::server
