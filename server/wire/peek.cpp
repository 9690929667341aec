#include "server/wire/peek.h"

#include <fmt/format.h>
#include <google/protobuf/wire_format_lite.h>

#include "engine/base/checked_number.h"
#include "limber/v1/service.pb.h"
#include "server/wire/coded_bytes.h"

namespace limber::server {
namespace {

namespace proto = limber::v1;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

constexpr int kPeekedFields = 8;  // more than a request has: longer lists are not walked on arrival
constexpr int kPeekedEdits = 70'000;  // the same of a body, which has at most 65,536 edits
constexpr int kLongestName = 128;
constexpr int kPeekedText = 64;  // bytes of Request.instance and Request.client

}  // namespace

RequestPeek peek_request(std::string_view bytes) {
  RequestPeek peek;
  if (bytes.empty()) {
    peek.fault = "an empty message";
    return peek;
  }
  CodedInputStream in = stream_of(bytes);
  for (int field = 0; const std::uint32_t tag = in.ReadTag(); ++field) {
    // A group is as long as its sender likes, and none is known: check_wire refuses both.
    if (field == kPeekedFields || Wire::GetTagWireType(tag) == Wire::WIRETYPE_START_GROUP)
      return peek;
    const int number = Wire::GetTagFieldNumber(tag);
    const bool varint = Wire::GetTagWireType(tag) == Wire::WIRETYPE_VARINT;
    std::uint64_t value = 0;
    if (varint && (number == 1 || number == 2 || number == 6)) {
      if (!in.ReadVarint64(&value)) break;
      if (number == 1) peek.version = to_whole<std::uint32_t>(value).value_or(0);
      if (number == 2) peek.id = value;
      if (number == 6) peek.most_reply_bytes = value;
      continue;
    }
    const bool text = Wire::GetTagWireType(tag) == Wire::WIRETYPE_LENGTH_DELIMITED;
    if (text && (number == 3 || number == 4)) {
      int length = 0;
      if (!in.ReadVarintSizeAsInt(&length)) break;
      if (length > kPeekedText) {
        peek.fault = fmt::format("{}: {} bytes, at most {} are allowed",
                                 number == 3 ? "instance" : "client", length, kPeekedText);
        return peek;
      }
      if (!in.ReadString(number == 3 ? &peek.instance : &peek.client, length)) break;
      continue;
    }
    if (number >= 10) peek.body = number;
    if (number == 0 || !Wire::SkipField(&in, tag)) {
      peek.fault =
          fmt::format("the bytes are not a protobuf message (from byte {})", in.CurrentPosition());
      return peek;
    }
  }
  if (!in.ConsumedEntireMessage()) {
    peek.fault =
        fmt::format("the bytes are not a protobuf message (from byte {})", in.CurrentPosition());
  }
  return peek;
}

std::string peek_session(std::string_view bytes, int body) {
  const FieldDescriptor* const request = proto::Request::descriptor()->FindFieldByNumber(body);
  if (request == nullptr || request->message_type() == nullptr) return "";
  const FieldDescriptor* const session = request->message_type()->FindFieldByName("session");
  if (session == nullptr || session->type() != FieldDescriptor::TYPE_STRING) return "";
  CodedInputStream in = stream_of(bytes);
  int expected = body;
  for (int field = 0; field < kPeekedEdits; ++field) {
    const std::uint32_t tag = in.ReadTag();
    if (tag == 0 || Wire::GetTagWireType(tag) == Wire::WIRETYPE_START_GROUP) return "";
    if (Wire::GetTagFieldNumber(tag) != expected) {
      if (!Wire::SkipField(&in, tag)) return "";
      continue;
    }
    int length = 0;
    if (Wire::GetTagWireType(tag) != Wire::WIRETYPE_LENGTH_DELIMITED ||
        !in.ReadVarintSizeAsInt(&length))
      return "";
    if (expected == body) {  // into the body
      in.PushLimit(length);
      expected = session->number();
      body = 0;
      continue;
    }
    std::string name;
    if (length > kLongestName || !in.ReadString(&name, length)) return "";
    return name.substr(0, name.find('@'));
  }
  return "";
}

}  // namespace limber::server
