#include "clients/cpp/reply_parts.h"

#include <string>
#include <string_view>

namespace limber::client {

bool may_have_long_answer(const v1::Request& request) {
  using Request = v1::Request;
  switch (request.body_case()) {
    case Request::kGetFrames:
      return request.get_frames().most_bytes() == 0;
    case Request::kGetGeometry:
    case Request::kGetMaterial:
    case Request::kGetSession:
    case Request::kSaveSession:
    case Request::kGetDesign:
    case Request::kGetBeamSolution:
    case Request::kExplain:
    case Request::kGetSample:
      return true;
    default:
      return false;
  }
}

bool knows_no_parts(const ClientError& error) {
  const std::string words =
      "unknown field number " + std::to_string(v1::Request::kMostReplyBytesFieldNumber) + " ";
  return error.code() == v1::ERROR_CODE_INVALID_ARGUMENT &&
         std::string_view(error.what()).find(words) != std::string_view::npos;
}

bool is_gone(const ClientError& error) {
  return error.code() == v1::ERROR_CODE_FAILED_PRECONDITION && error.field() == "reply";
}

}  // namespace limber::client
