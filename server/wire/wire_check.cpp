#include "server/wire/wire_check.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "engine/base/checked_number.h"
#include "limber/v1/service.pb.h"
#include "server/wire/coded_bytes.h"
#include "server/wire/version.h"

namespace limber::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

constexpr int kMaxDepth = 64;
constexpr std::size_t kUsualFields = 64;  // of a message; others take memory of the heap

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

class Walker {
 public:
  Walker(CodedInputStream& in, WireBudget& budget) : in_(in), budget_(budget) {}

  void message(const Descriptor& type, const Step* at, int depth) {
    if (depth > kMaxDepth) throw malformed(fmt::format("{}: nested too deeply", path_of(at)));
    if (static_cast<std::size_t>(type.field_count()) <= kUsualFields) {
      std::array<int, kUsualFields> occurrences{};
      std::array<const FieldDescriptor*, kUsualFields> oneofs{};
      fields(type, at, depth, {occurrences, oneofs});
    } else {
      const auto count = static_cast<std::size_t>(type.field_count());
      std::vector<int> occurrences(count, 0);
      std::vector<const FieldDescriptor*> oneofs(count, nullptr);
      fields(type, at, depth, {occurrences, oneofs});
    }
  }

 private:
  /// Fields of a message met so far.
  struct Met {
    std::span<int> occurrences;                // by index of the field: how often
    std::span<const FieldDescriptor*> oneofs;  // by index of the oneof: its member that is given
  };

  void fields(const Descriptor& type, const Step* at, int depth, const Met& met) {
    while (true) {
      const std::uint32_t tag = in_.ReadTag();
      if (tag == 0) {
        if (!in_.ConsumedEntireMessage()) throw truncated(at);
        return;
      }
      const int number = Wire::GetTagFieldNumber(tag);
      const FieldDescriptor* field = type.FindFieldByNumber(number);
      if (field == nullptr) {
        constexpr int kMostPassedOver = 64;
        const bool is_group = Wire::GetTagWireType(tag) == Wire::WIRETYPE_START_GROUP;
        if (number == 0 || is_group || !may_have_more(type) || ++passed_over_ > kMostPassedOver)
          throw unknown(type, number, path_of(at));
        if (!Wire::SkipField(&in_, tag)) throw truncated(at);
        continue;
      }
      const Step step{at, field, met.occurrences[static_cast<std::size_t>(field->index())]++};
      check_once(*field, step, met.oneofs);
      value(*field, Wire::GetTagWireType(tag), step, depth);
    }
  }

  /// Clients of any version say which they are of.
  static bool may_have_more(const Descriptor& type) {
    return &type == proto::GetServerInfoRequest::descriptor();
  }

  /// Nothing is dropped: what a newer client means by it would not be done.
  static Refusal unknown(const Descriptor& type, int number, const std::string& path) {
    constexpr int kFirstBody = 10;
    const std::string words = fmt::format("unknown field number {} in {}", number, type.name());
    if (&type == proto::Request::descriptor() && number >= kFirstBody)
      return unsupported(path, words, fmt::format("requests of number {}", number));
    if (&type == proto::Edit::descriptor())
      return unsupported(path, words, fmt::format("edits of number {}", number));
    return invalid(path, fmt::format("{}; {}", words, unknown_here("it")));
  }
  static Refusal unsupported(const std::string& path, const std::string& words,
                             const std::string& what) {
    return {proto::ERROR_CODE_UNSUPPORTED,
            path,
            fmt::format("{}; {}", words, unknown_here(what)),
            {{"server_version", server_version()}}};
  }

  static Refusal truncated(const Step* at) {
    const std::string path = path_of(at);
    return malformed(path.empty() ? "the bytes end inside a field"
                                  : fmt::format("{}: the bytes end inside a field", path));
  }

  static void check_once(const FieldDescriptor& field, const Step& step,
                         std::span<const FieldDescriptor*> oneofs) {
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
    if (field.type() == FieldDescriptor::TYPE_GROUP) {
      throw invalid(path_of(&step), "is a group, which requests do not have");
    } else if (wire == Wire::WIRETYPE_LENGTH_DELIMITED && expected != wire && field.is_packable()) {
      packed(field, step);
    } else if (wire != expected) {
      throw invalid(path_of(&step),
                    fmt::format("wire type {} where {} is expected", static_cast<int>(wire),
                                static_cast<int>(expected)));
    } else if (field.type() == FieldDescriptor::TYPE_MESSAGE) {
      submessage(field, step, depth);
    } else if (wire == Wire::WIRETYPE_LENGTH_DELIMITED) {
      const int length = read_length(step);
      if (field.type() == FieldDescriptor::TYPE_STRING) demand_no_zero(length, step);
      if (!in_.Skip(length)) throw truncated(&step);
    } else {
      number(field, expected, step);
    }
  }

  /// A zero byte ends a path, and a message that repeats the text.
  void demand_no_zero(int length, const Step& step) {
    const void* text = nullptr;
    int there = 0;
    if (length == 0 || !in_.GetDirectBufferPointer(&text, &there)) return;
    if (std::memchr(text, 0, static_cast<std::size_t>(std::min(length, there))) != nullptr)
      throw invalid(path_of(&step), "the text has a zero byte");
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
    if (++budget_.spent > budget_.submessages) {
      throw limit_exceeded(path_of(&step), "submessages in one message", budget_.submessages,
                           budget_.spent);
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
        const auto number = to_whole<int>(static_cast<std::int64_t>(value));
        if (!number || field.enum_type()->FindValueByNumber(*number) == nullptr) {
          throw invalid(path_of(&step),
                        fmt::format("{} is no value of {}; {}", static_cast<std::int64_t>(value),
                                    field.enum_type()->name(), unknown_here("it")));
        }
      }
      check_fits(field, value, step);
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

  /// If a number does not fit its field, protobuf silently reads the lower 32 bits.
  static void check_fits(const FieldDescriptor& field, std::uint64_t value, const Step& step) {
    bool fits = true;
    std::string given = std::to_string(value);
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32 ||
        field.type() == FieldDescriptor::TYPE_SINT32) {
      fits = to_whole<std::uint32_t>(value).has_value();
    } else if (field.type() == FieldDescriptor::TYPE_INT32) {
      const auto number = std::bit_cast<std::int64_t>(value);
      fits = to_whole<std::int32_t>(number).has_value();
      given = std::to_string(number);
    }
    if (!fits) throw invalid(path_of(&step), given + " does not fit 32 bits");
  }

  static void check_finite(double value, const Step& step) {
    if (!std::isfinite(value))
      throw invalid(path_of(&step), fmt::format("{} is not a finite number", value));
  }

  CodedInputStream& in_;
  WireBudget& budget_;
  int passed_over_ = 0;  // unknown fields
};

}  // namespace

void check_wire(std::string_view bytes, const Descriptor& type, WireBudget& budget) {
  CodedInputStream in = stream_of(bytes);
  Walker(in, budget).message(type, nullptr, 0);
}

void check_wire(std::string_view bytes, const Descriptor& type) {
  WireBudget budget;
  check_wire(bytes, type, budget);
}

}  // namespace limber::server
