#include "server/wire/errors.h"

#include <fmt/format.h>

#include <new>

#include "server/wire/abbreviate.h"

namespace limber::server {

Refusal invalid(const std::string& field, const std::string& message) {
  return {proto::ERROR_CODE_INVALID_ARGUMENT, field, message};
}

Refusal malformed(const std::string& message) { return {proto::ERROR_CODE_MALFORMED, "", message}; }

Refusal shutting_down() {
  return {proto::ERROR_CODE_SHUTTING_DOWN, "", "the server is going down"};
}

Refusal limit_exceeded(const std::string& field, const std::string& what, std::uint64_t limit,
                       std::uint64_t value) {
  return {proto::ERROR_CODE_LIMIT_EXCEEDED,
          field,
          fmt::format("{} {}: more than the limit of {}", value, what, limit),
          {{"limit", std::to_string(limit)}, {"value", std::to_string(value)}}};
}

proto::ErrorCode to_proto(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return proto::ERROR_CODE_INVALID_ARGUMENT;
    case ErrorCode::kOutOfRange:
      return proto::ERROR_CODE_OUT_OF_RANGE;
    case ErrorCode::kNotFound:
      return proto::ERROR_CODE_NOT_FOUND;
    case ErrorCode::kAlreadyExists:
      return proto::ERROR_CODE_ALREADY_EXISTS;
    case ErrorCode::kUnsupported:
      return proto::ERROR_CODE_UNSUPPORTED;
    case ErrorCode::kLimitExceeded:
      return proto::ERROR_CODE_LIMIT_EXCEEDED;
    case ErrorCode::kFailedPrecondition:
      return proto::ERROR_CODE_FAILED_PRECONDITION;
    case ErrorCode::kCancelled:
      return proto::ERROR_CODE_CANCELLED;
    case ErrorCode::kIo:
      return proto::ERROR_CODE_IO;
    case ErrorCode::kNumerical:
      return proto::ERROR_CODE_NUMERICAL;
    case ErrorCode::kInternal:
      return proto::ERROR_CODE_INTERNAL;
  }
  return proto::ERROR_CODE_INTERNAL;
}

namespace {

// Messages repeat names and paths of requests, which may have the size of a request.
constexpr std::size_t kMaxOfMessage = 4000, kMaxOfField = 1000;

}  // namespace

proto::Error error_to_proto(const std::exception& fault, const std::string& prefix) {
  proto::Error error;
  if (const auto* refusal = dynamic_cast<const Refusal*>(&fault)) {
    error.set_code(refusal->code());
    error.set_field(abbreviate(refusal->field(), kMaxOfField));
    for (const auto& [key, value] : refusal->details())
      (*error.mutable_details())[key] = abbreviate(value, kMaxOfField);
  } else if (const auto* engine = dynamic_cast<const Error*>(&fault)) {
    error.set_code(to_proto(engine->code()));
    if (!engine->field().empty())
      error.set_field(abbreviate(prefix + engine->field(), kMaxOfField));
  } else if (dynamic_cast<const std::bad_alloc*>(&fault) != nullptr) {
    error.set_code(proto::ERROR_CODE_LIMIT_EXCEEDED);
    error.set_message("out of memory");
    return error;
  } else {
    error.set_code(proto::ERROR_CODE_INTERNAL);
  }
  error.set_message(abbreviate(fault.what(), kMaxOfMessage));
  return error;
}

}  // namespace limber::server
