#include "server/kinds/beams/checkpoint.h"

#include "server/kinds/beams/structure.h"
#include "server/wire/snapshots.h"

namespace limber::server {

proto::StoredBeams encode_beam_checkpoint(const session::BeamDocument::Checkpoint& checkpoint) {
  proto::StoredBeams message;
  *message.mutable_history() = encode_snapshots(checkpoint.history, encode_beam_conditions);
  return message;
}

session::BeamDocument::Checkpoint decode_beam_checkpoint(const proto::StoredBeams& message,
                                                         session::Revision revision) {
  using Checkpoint = session::BeamDocument::Checkpoint;
  return {revision, decode_snapshots<proto::BeamStructure, decltype(Checkpoint::history)>(
                        message.history(), [](const proto::BeamStructure& structure) {
                          return decode_beam_conditions(structure, "checkpoint");
                        })};
}

}  // namespace limber::server
