#include "server/wire/edit_fields.h"

#include <fmt/format.h>

#include <charconv>

#include "server/wire/issues.h"

namespace limber::server {
namespace {

/// Where the values of an edit are: a message in it, or the edit itself.
const google::protobuf::FieldDescriptor* values_of(const google::protobuf::Descriptor& edit) {
  for (const char* name : {"pin", "target", "load", "support", "motion"}) {
    if (const auto* inner = edit.FindFieldByName(name)) return inner;
  }
  return nullptr;
}

/// Names of the engine's values as the messages have them; empty: of none of their own.
std::string name_in(const google::protobuf::Descriptor& message, const std::string& name) {
  for (const std::string what : {"segment_lengths", "edge_lengths", "section_scales"})
    if (name.starts_with(what)) return name.substr(what.find('_') + 1);
  if (name == "angle" || name == "mean_angle") return name_in(message, "angle_degrees");
  if (message.FindFieldByName("segment") != nullptr && (name == "segment" || name == "share"))
    return "segment." + name;
  return message.FindFieldByName(name) != nullptr ? name : "";
}

}  // namespace

const google::protobuf::FieldDescriptor* edit_kind(const proto::Edit& edit) {
  return edit.GetReflection()->GetOneofFieldDescriptor(
      edit, proto::Edit::descriptor()->FindOneofByName("edit"));
}

std::optional<int> edit_index(const proto::EditRequest& message, const std::string& field) {
  const std::string opening = "edits[";
  if (!field.starts_with(opening)) return std::nullopt;
  int index = -1;
  const char* const end = field.data() + field.size();
  const char* const stop = std::from_chars(field.data() + opening.size(), end, index).ptr;
  if (stop == end || *stop != ']' || index < 0 || index >= message.edits_size())
    return std::nullopt;
  return index;
}

std::string edit_field_in(const proto::EditRequest& message, const std::string& field) {
  const auto index = edit_index(message, field);
  if (!index) return field;
  const auto* kind = edit_kind(message.edits(*index));
  if (kind == nullptr) return field;
  std::string path = fmt::format("edits[{}].{}", *index, kind->name());
  const auto* descriptor = kind->message_type();
  if (const auto* inner = values_of(*descriptor)) {
    path += "." + inner->name();
    descriptor = inner->message_type();
  }
  const std::string rest = field.substr(field.find(']') + 1);
  const std::string name =
      rest.empty() ? "" : name_in(*descriptor, rest.substr(rest.rfind('.') + 1));
  return name.empty() ? path : path + "." + name;
}

void add_issues(const proto::EditRequest& message, const std::vector<scene::Issue>& issues,
                proto::EditResponse& response) {
  for (scene::Issue issue : issues) {
    issue.field = edit_field_in(message, issue.field);
    *response.add_issues() = encode_issue(issue, "");
  }
}

std::optional<std::uint64_t> expected_revision(const proto::EditRequest& message) {
  if (!message.has_expected_revision()) return {};
  return message.expected_revision();
}

bool is_too_many_steps(const Error& error) {
  return error.code() == ErrorCode::kLimitExceeded && error.field().ends_with(".steps_at_once");
}

Refusal too_many_steps(const std::string& field, const Error& error, int limit) {
  return Refusal(proto::ERROR_CODE_LIMIT_EXCEEDED, field, error.what(),
                 {{"limit", std::to_string(limit)}, {"value", std::to_string(limit + 1)}});
}

}  // namespace limber::server
