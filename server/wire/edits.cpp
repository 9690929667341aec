#include "server/wire/edits.h"

#include <algorithm>
#include <memory>
#include <string_view>

#include "engine/base/checked_number.h"
#include "server/wire/fields.h"
#include "server/wire/issues.h"

namespace limber::server {

const google::protobuf::FieldDescriptor* edit_kind(const proto::Edit& edit) {
  return edit.GetReflection()->GetOneofFieldDescriptor(
      edit, proto::Edit::descriptor()->FindOneofByName("edit"));
}

std::vector<std::string> kinds_of_edits(const proto::EditRequest& request) {
  std::vector<std::string> kinds;
  for (const proto::Edit& edit : request.edits()) {
    const auto* kind = edit_kind(edit);
    if (kind == nullptr) continue;
    if (std::find(kinds.begin(), kinds.end(), kind->name()) == kinds.end())
      kinds.push_back(kind->name());
  }
  return kinds;
}

std::string edit_field_in(const proto::EditRequest& message, const std::string& field,
                          const google::protobuf::Message* extension) {
  constexpr std::string_view kOpening = "edits[";
  const std::size_t close = field.find(']');
  if (extension == nullptr || !field.starts_with(kOpening) || close == std::string::npos)
    return field_in(message, field);
  const std::string_view digits(field.data() + kOpening.size(), close - kOpening.size());
  const int index = parse_number<int>(digits).value_or(-1);
  if (index < 0 || index >= message.edits_size() || !message.edits(index).has_extension())
    return field_in(message, field);
  const std::unique_ptr<google::protobuf::Message> edit(extension->New());
  if (!message.edits(index).extension().UnpackTo(edit.get())) return field_in(message, field);
  const std::string path = field.substr(0, close + 1) + ".extension";
  const std::string inner =
      field_in(*edit, close + 2 < field.size() ? field.substr(close + 2) : "");
  return inner.empty() ? path : path + "." + inner;
}

proto::EditResponse begin_response(const session::EditReceipt& receipt) {
  proto::EditResponse response;
  response.set_revision(receipt.revision);
  for (const auto& issue : receipt.issues) *response.add_issues() = encode_issue(issue);
  return response;
}

std::optional<std::uint64_t> expected_revision(const proto::EditRequest& message) {
  if (!message.has_expected_revision()) return {};
  return message.expected_revision();
}

}  // namespace limber::server
