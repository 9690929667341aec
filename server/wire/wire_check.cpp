#include "server/wire/wire_check.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "limber/v1/service.pb.h"

namespace limber::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

constexpr int kMaxDepth = 64;
constexpr int kMaxFields = 64;
constexpr int kPeekedFields =
    8;  // more than a request has: what is longer is not walked on arrival
constexpr int kPeekedEdits = 70'000;  // the same of a body, which has at most 65,536 edits
constexpr int kLongestName = 128;
constexpr int kPeekedText = 64;  // bytes of Request.instance and Request.client

/// The path to a field; built on the stack, turned into text only when something is wrong.
struct Step {
  const Step* parent;
  const FieldDescriptor* field;
  int index;
};

/// Fields of a request are named from its body on, as the engine's errors are: "edits[1].move".
std::string path_of(const Step* step) {
  std::string path;
  for (; step != nullptr && step->field != nullptr; step = step->parent) {
    const bool is_body = step->field->containing_type() == proto::Request::descriptor() &&
                         step->field->real_containing_oneof() != nullptr;
    if (is_body && !path.empty()) break;
    std::string here = step->field->name();
    if (step->field->is_repeated()) here += fmt::format("[{}]", step->index);
    path = path.empty() ? here : here + "." + path;
  }
  return path;
}

CodedInputStream stream_of(std::string_view bytes) {
  return CodedInputStream(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                          static_cast<int>(bytes.size()));
}

class Walker {
 public:
  Walker(CodedInputStream& in, const WireLimits& limits) : in_(in), limits_(limits) {}

  void message(const Descriptor& type, const Step* at, int depth) {
    if (depth > kMaxDepth) throw malformed(fmt::format("{}: nested too deeply", path_of(at)));
    LIMBER_DEMAND(type.field_count() <= kMaxFields);
    std::array<int, kMaxFields> occurrences{};
    std::array<const FieldDescriptor*, kMaxFields> oneofs{};
    while (true) {
      const std::uint32_t tag = in_.ReadTag();
      if (tag == 0) {
        if (!in_.ConsumedEntireMessage()) throw truncated(at);
        return;
      }
      const int number = Wire::GetTagFieldNumber(tag);
      const FieldDescriptor* field = type.FindFieldByNumber(number);
      if (field == nullptr) {
        const std::string path = path_of(at);
        throw invalid(path, fmt::format("unknown field number {} in {}", number, type.name()));
      }
      const Step step{at, field, occurrences[static_cast<std::size_t>(field->index())]++};
      check_once(*field, step, oneofs);
      value(*field, Wire::GetTagWireType(tag), step, depth);
    }
  }

 private:
  static Refusal truncated(const Step* at) {
    const std::string path = path_of(at);
    return malformed(path.empty() ? "the bytes end inside a field"
                                  : fmt::format("{}: the bytes end inside a field", path));
  }

  static void check_once(const FieldDescriptor& field, const Step& step,
                         std::array<const FieldDescriptor*, kMaxFields>& oneofs) {
    if (field.is_repeated()) return;
    if (step.index > 0) throw invalid(path_of(&step), "given twice");
    if (const auto* oneof = field.real_containing_oneof()) {
      auto& other = oneofs[static_cast<std::size_t>(oneof->index())];
      if (other != nullptr) {
        throw invalid(path_of(&step), fmt::format("given beside {}, only one of {} is allowed",
                                                  other->name(), oneof->name()));
      }
      other = &field;
    }
  }

  void value(const FieldDescriptor& field, Wire::WireType wire, const Step& step, int depth) {
    const auto expected = Wire::WireTypeForFieldType(static_cast<Wire::FieldType>(field.type()));
    if (wire == Wire::WIRETYPE_LENGTH_DELIMITED && expected != wire && field.is_packable()) {
      packed(field, step);
    } else if (wire != expected) {
      throw invalid(path_of(&step),
                    fmt::format("wire type {} where {} is expected", static_cast<int>(wire),
                                static_cast<int>(expected)));
    } else if (field.type() == FieldDescriptor::TYPE_MESSAGE) {
      submessage(field, step, depth);
    } else if (wire == Wire::WIRETYPE_LENGTH_DELIMITED) {
      const int length = read_length(step);
      if (!in_.Skip(length)) throw truncated(&step);
    } else {
      number(field, expected, step);
    }
  }

  int read_length(const Step& step) {
    int length = 0;
    if (!in_.ReadVarintSizeAsInt(&length)) throw truncated(&step);
    if (length > in_.BytesUntilTotalBytesLimit() && in_.BytesUntilTotalBytesLimit() >= 0)
      throw truncated(&step);
    if (in_.BytesUntilLimit() >= 0 && length > in_.BytesUntilLimit()) throw truncated(&step);
    return length;
  }

  void submessage(const FieldDescriptor& field, const Step& step, int depth) {
    if (++submessages_ > limits_.submessages) {
      throw limit_exceeded(path_of(&step), "submessages in one message", limits_.submessages,
                           submessages_);
    }
    const int length = read_length(step);
    const auto limit = in_.PushLimit(length);
    message(*field.message_type(), &step, depth + 1);
    if (in_.BytesUntilLimit() != 0) throw truncated(&step);
    in_.PopLimit(limit);
  }

  void packed(const FieldDescriptor& field, const Step& step) {
    const auto expected = Wire::WireTypeForFieldType(static_cast<Wire::FieldType>(field.type()));
    const int length = read_length(step);
    const auto limit = in_.PushLimit(length);
    Step element = step;
    element.index = 0;
    for (; in_.BytesUntilLimit() > 0; ++element.index) number(field, expected, element);
    in_.PopLimit(limit);
  }

  void number(const FieldDescriptor& field, Wire::WireType wire, const Step& step) {
    if (wire == Wire::WIRETYPE_VARINT) {
      std::uint64_t value = 0;
      if (!in_.ReadVarint64(&value)) throw truncated(&step);
      if (field.type() == FieldDescriptor::TYPE_ENUM) {
        const int number = static_cast<int>(value);
        if (field.enum_type()->FindValueByNumber(number) == nullptr) {
          throw invalid(path_of(&step),
                        fmt::format("{} is no value of {}", number, field.enum_type()->name()));
        }
      }
    } else if (wire == Wire::WIRETYPE_FIXED64) {
      std::uint64_t bits = 0;
      if (!in_.ReadLittleEndian64(&bits)) throw truncated(&step);
      if (field.type() == FieldDescriptor::TYPE_DOUBLE)
        check_finite(std::bit_cast<double>(bits), step);
    } else {
      std::uint32_t bits = 0;
      if (!in_.ReadLittleEndian32(&bits)) throw truncated(&step);
      if (field.type() == FieldDescriptor::TYPE_FLOAT)
        check_finite(std::bit_cast<float>(bits), step);
    }
  }

  static void check_finite(double value, const Step& step) {
    if (!std::isfinite(value))
      throw invalid(path_of(&step), fmt::format("{} is not a finite number", value));
  }

  CodedInputStream& in_;
  WireLimits limits_;
  std::uint64_t submessages_ = 0;
};

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
    if (varint && (number == 1 || number == 2)) {
      if (!in.ReadVarint64(&value)) break;
      if (number == 1) peek.version = static_cast<std::uint32_t>(value);
      if (number == 2) peek.id = value;
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

void check_wire(std::string_view bytes, const Descriptor& type, const WireLimits& limits) {
  CodedInputStream in = stream_of(bytes);
  Walker(in, limits).message(type, nullptr, 0);
}

}  // namespace limber::server
