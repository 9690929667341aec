#include "server/wire/fields.h"

#include <google/protobuf/descriptor.h>

#include <string_view>

#include "engine/base/checked_number.h"
#include "limber/v1/common.pb.h"

namespace limber::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::OneofDescriptor;
namespace proto = limber::v1;

/// The first step of a path: "nodes[3].position" is name "nodes", index "[3]", rest "position".
struct PathStep {
  std::string name, index, rest;
  int at = -1;  // in the list; -1: no index
};

PathStep first_step(const std::string& field) {
  PathStep step;
  const std::size_t dot = field.find('.');
  step.name = field.substr(0, dot);
  if (dot != std::string::npos) step.rest = field.substr(dot + 1);
  if (const std::size_t open = step.name.find('['); open != std::string::npos) {
    step.index = step.name.substr(open);
    step.name.resize(open);
    step.at = parse_number<int>(std::string_view(step.index).substr(1, step.index.find(']') - 1))
                  .value_or(-1);
  }
  return step;
}

std::string joined(const std::string& path, const std::string& rest) {
  return path.empty() || rest.empty() ? path + rest : path + "." + rest;
}

/// Numbers in a row: the rest of the path after their name belongs to the numbers.
bool is_value(const Descriptor& type) {
  return &type == proto::Array::descriptor() || &type == proto::Vector3::descriptor();
}

bool is_submessage(const FieldDescriptor& field) {
  return field.message_type() != nullptr && !field.is_repeated() &&
         !is_value(*field.message_type());
}

const FieldDescriptor* given_of(const Message& message, const OneofDescriptor& oneof) {
  return message.GetReflection()->GetOneofFieldDescriptor(message, &oneof);
}

/// A member of the message; in a oneof only the given one.
const FieldDescriptor* member(const Message& message, const std::string& name) {
  const FieldDescriptor* const field = message.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr || field->real_containing_oneof() == nullptr) return field;
  return message.GetReflection()->HasField(message, field) ? field : nullptr;
}

/// For a message that is a choice of several and nothing else: its oneof.
const OneofDescriptor* choice_of(const Descriptor& type) {
  if (type.real_oneof_decl_count() != 1) return nullptr;
  // Other members may be numbers that describe the chosen one further.
  for (int i = 0; i < type.field_count(); ++i) {
    if (type.field(i)->containing_oneof() == nullptr) return nullptr;
  }
  return type.oneof_decl(0);
}

/// The wrapped member of a message: the first one, if that is a message of its own.
const FieldDescriptor* wrapped_by(const Descriptor& type) {
  return type.field_count() > 0 && is_submessage(*type.field(0)) &&
                 type.field(0)->real_containing_oneof() == nullptr
             ? type.field(0)
             : nullptr;
}

/// The given member, and the one that it wraps. Empty where none is.
std::string given_as_a_whole(const Message& message, const OneofDescriptor& choice) {
  const FieldDescriptor* const given = given_of(message, choice);
  if (given == nullptr) return "";
  const FieldDescriptor* const inner =
      is_submessage(*given) ? wrapped_by(*given->message_type()) : nullptr;
  return joined(given->name(), inner == nullptr ? "" : inner->name());
}

/// The end of a path at a message. The source of data and the kind of a list's entry have names of
/// their own; the kind of a shape is part of it.
std::string end_in(const Message& message, bool is_entry) {
  const OneofDescriptor* const choice = choice_of(*message.GetDescriptor());
  if (choice == nullptr || !(is_entry || choice->name() == "source")) return "";
  return given_as_a_whole(message, *choice);
}

std::string in_list(const Message& message, const FieldDescriptor& list, const PathStep& step) {
  const std::string path = list.name() + step.index;
  const bool is_there = list.message_type() != nullptr && !is_value(*list.message_type()) &&
                        step.at >= 0 &&
                        step.at < message.GetReflection()->FieldSize(message, &list);
  if (!is_there) return joined(path, step.rest);
  const Message& entry = message.GetReflection()->GetRepeatedMessage(message, &list, step.at);
  return joined(path, step.rest.empty() ? end_in(entry, true) : field_in(entry, step.rest));
}

/// The list that a message has for one, as there are no optional lists: of the message's own name,
/// or the only one of numbers. Null where it is no such message.
const FieldDescriptor* list_of(const Descriptor& type, const PathStep& step) {
  if (type.field_count() != 1 || !type.field(0)->is_repeated()) return nullptr;
  const bool is_of_numbers = type.field(0)->message_type() == nullptr;
  return is_of_numbers || !step.index.empty() ? type.field(0) : nullptr;
}

std::string in_member(const Message& message, const FieldDescriptor& field, const PathStep& step) {
  if (field.is_repeated()) return in_list(message, field, step);
  if (field.message_type() == nullptr) return field.name();
  if (is_value(*field.message_type())) return joined(field.name() + step.index, step.rest);
  const Message& inner = message.GetReflection()->GetMessage(message, &field);
  if (const auto* list = list_of(*field.message_type(), step))
    return joined(field.name(), in_list(inner, *list, step));
  // If the inner member has the same name: "segment" is "segment.segment".
  if (const auto* same = member(inner, field.name());
      same != nullptr && step.rest.empty() && !same->is_repeated())
    return joined(field.name(), same->name() + step.index);
  return joined(field.name(),
                step.rest.empty() ? end_in(inner, false) : field_in(inner, step.rest));
}

std::optional<std::string> in_inner(const Message& message, const FieldDescriptor* field,
                                    const std::string& path) {
  if (field == nullptr || !is_submessage(*field)) return std::nullopt;
  const auto place = find_field(message.GetReflection()->GetMessage(message, field), path);
  if (!place) return std::nullopt;
  return joined(field->name(), *place);
}

}  // namespace

std::optional<std::string> find_field(const Message& message, const std::string& field) {
  const PathStep step = first_step(field);
  if (step.name.empty()) return std::nullopt;
  for (const std::string& name : {step.name, step.name + "_degrees"})
    if (const auto* own = member(message, name)) return in_member(message, *own, step);
  const Descriptor& type = *message.GetDescriptor();
  for (int i = 0; i < type.real_oneof_decl_count(); ++i) {
    const OneofDescriptor& oneof = *type.oneof_decl(i);
    const FieldDescriptor* const given = given_of(message, oneof);
    if (given != nullptr && oneof.name() == step.name)
      return joined(given->name() + step.index, step.rest);
    if (auto place = in_inner(message, given, field)) return place;
  }
  if (auto place = in_inner(message, wrapped_by(type), field)) return place;
  const std::size_t word = field.find('_');
  if (word >= step.name.size()) return std::nullopt;
  return find_field(message, field.substr(word + 1));
}

std::string field_in(const Message& message, const std::string& field) {
  if (auto place = find_field(message, field)) return *place;
  const OneofDescriptor* const choice = choice_of(*message.GetDescriptor());
  return choice == nullptr ? field : given_as_a_whole(message, *choice);
}

}  // namespace limber::server
