#include "server/service/imported_session.h"

#include <fmt/format.h>

#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "engine/base/hash.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

void demand_countable(std::uint64_t number, const std::string& field) {
  if (number < kMostImportedNumber) return;
  throw invalid(field, fmt::format("{} is no number that a server has counted to: it must be less "
                                   "than 2^53",
                                   number));
}

std::uint64_t checksum_of(std::string_view bytes) {
  const auto digest = ContentHash().add(bytes).digest();
  std::uint64_t first = 0;
  std::memcpy(&first, digest.data(), sizeof first);
  return first;
}

/// Ids of constraints, keyframes and targets, and what follows from them.
bool is_of_ids(const FieldDescriptor& field) {
  static const std::set<std::string> kNames{
      "id",         "remove_constraint", "remove_keyframe", "next_constraint", "next_keyframe",
      "last_target"};
  return kNames.contains(field.name());
}

/// All uint64 fields of a message and of those in it, but for ids.
void demand_all_countable(const Message& message, const std::string& at) {
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const bool is_number = field->cpp_type() == FieldDescriptor::CPPTYPE_UINT64;
    if (!is_number && field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (is_number && is_of_ids(*field)) continue;
    const std::string name = at + '.' + field->name();
    if (!field->is_repeated()) {
      if (is_number) {
        demand_countable(reflection.GetUInt64(message, field), name);
      } else {
        demand_all_countable(reflection.GetMessage(message, field), name);
      }
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      const std::string entry = fmt::format("{}[{}]", name, i);
      if (is_number) {
        demand_countable(reflection.GetRepeatedUInt64(message, field, i), entry);
      } else {
        demand_all_countable(reflection.GetRepeatedMessage(message, field, i), entry);
      }
    }
  }
}

}  // namespace

void demand_countable(const proto::StoredSession& stored) {
  demand_all_countable(stored.checkpoint(), "content.checkpoint");
  const proto::StoredAnswer& answer = stored.answer();
  demand_countable(answer.revision(), "content.answer.revision");
  demand_countable(answer.sequence(), "content.answer.sequence");
  demand_all_countable(answer.result(), "content.answer.result");
  std::uint64_t revision = stored.checkpoint().revision();
  for (int i = 0; i < stored.edits_size(); ++i) {
    const std::string edit = fmt::format("content.edits[{}]", i);
    const std::uint64_t number = stored.edits(i).revision();
    demand_countable(number, edit + ".revision");
    demand_countable(stored.edits(i).at_ms(), edit + ".at_ms");
    if (number != ++revision)
      throw invalid(edit + ".revision", fmt::format("{}, where {} follows", number, revision));
  }
}

std::string sealed(const proto::StoredSession& stored) {
  proto::StoredSession end;
  std::string bytes = stored.SerializeAsString();
  end.set_checksum(checksum_of(bytes));
  return bytes + end.SerializeAsString();  // fields of a message may come in any order
}

void demand_unchanged(std::string_view content, const proto::StoredSession& stored) {
  if (!stored.has_checksum()) return;
  proto::StoredSession end;
  end.set_checksum(stored.checksum());
  const std::string last = end.SerializeAsString();
  if (content.ends_with(last) &&
      checksum_of(content.substr(0, content.size() - last.size())) == stored.checksum())
    return;
  throw invalid("content", "the session was changed since it was exported: its checksum is wrong");
}

}  // namespace limber::server
