// Edits of sessions of elastic bodies.
#include <algorithm>
#include <optional>
#include <utility>

#include "server/kinds/bodies/checkpoint.h"
#include "server/kinds/bodies/edit.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/mesh_sources.h"
#include "server/kinds/bodies/record.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

/// Constraints after the edits, or nothing where only the session can tell.
std::optional<std::size_t> count_after(std::size_t before,
                                       const std::vector<session::BodyEdit>& edits) {
  for (const auto& edit : edits) {
    if (std::holds_alternative<session::Undo>(edit) || std::holds_alternative<session::Redo>(edit))
      return std::nullopt;
    if (std::holds_alternative<session::AddConstraint>(edit)) ++before;
    if (std::holds_alternative<session::RemoveConstraint>(edit)) before -= before > 0 ? 1 : 0;
  }
  return before;
}

template <class Kind>
std::size_t count_of(const std::vector<session::BodyEdit>& edits) {
  return static_cast<std::size_t>(std::count_if(
      edits.begin(), edits.end(),
      [](const session::BodyEdit& edit) { return std::holds_alternative<Kind>(edit); }));
}

}  // namespace

proto::EditResponse BodyRecord::edit(const proto::EditRequest& request,
                                     const session::Author& author) {
  const auto session = this->session();
  const auto edits =
      decode_edits(request, *session->unedited(),
                   mesh_loader(opened_.resolve, mesh_read_limits(hub_.options.limits)));
  const std::size_t before = constraint_count();
  const auto after = count_after(before, edits);
  const std::size_t added = count_of<session::AddConstraint>(edits);
  const std::size_t poses = count_of<session::AddKeyframe>(edits);
  const bool moves_pins = std::any_of(edits.begin(), edits.end(), [](const auto& edit) {
    const auto* const pins = std::get_if<session::SetPins>(&edit);
    return pins != nullptr && pins->paths != nullptr;
  });
  if (added + poses > 0 || moves_pins) {
    demand_memory(after.value_or(before + added), session->keyframes().size() + poses,
                  moves_pins ? Pins::kEdited : Pins::kAsTheyAre);
  }
  const session::EditReceipt receipt = make_edits(request, edits, author);
  // Edits with poses may be processed in parallel to others.
  const bool known = after && poses == 0;
  constraints_changed(known ? *after : session->constraints().size());
  return encode_receipt(receipt);
}

Record::CheckpointWriter BodyRecord::checkpoint() const {
  const auto session = this->session();
  return [session, checkpoint = session->checkpoint()](proto::StoredCheckpoint& message) {
    message.set_revision(checkpoint.revision);
    *message.mutable_body() = encode_body_checkpoint(checkpoint);
    session->demand_reachable(decode_body_checkpoint(message.body(), checkpoint.revision));
  };
}

void BodyRecord::begin_at(const proto::StoredCheckpoint& checkpoint) {
  demand_document(checkpoint.has_body());
  const auto session = this->session();
  const auto read = decode_body_checkpoint(checkpoint.body(), checkpoint.revision());
  demand_memory(read.constraints.size(), read.keyframes.size(),
                read.pins ? Pins::kEdited : Pins::kAsTheyAre);
  session->begin_at(read);
  constraints_changed(read.constraints.size());
}

}  // namespace limber::server
