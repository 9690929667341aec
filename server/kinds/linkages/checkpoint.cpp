#include "server/kinds/linkages/checkpoint.h"

#include "server/kinds/linkages/scene.h"
#include "server/wire/snapshots.h"

namespace limber::server {

proto::StoredLinkage encode_linkage_checkpoint(
    const session::LinkageDocument::Checkpoint& checkpoint) {
  proto::StoredLinkage message;
  *message.mutable_history() = encode_snapshots(checkpoint.history, encode_linkage_conditions);
  message.set_last_target(checkpoint.last_id);
  message.set_is_return(checkpoint.is_return);
  return message;
}

session::LinkageDocument::Checkpoint decode_linkage_checkpoint(const proto::StoredLinkage& message,
                                                               session::Revision revision) {
  using Checkpoint = session::LinkageDocument::Checkpoint;
  return {revision,
          decode_snapshots<proto::RodLinkage, decltype(Checkpoint::history)>(
              message.history(),
              [](const proto::RodLinkage& conditions) {
                return decode_linkage_conditions(conditions, "checkpoint");
              }),
          message.last_target(), message.is_return()};
}

}  // namespace limber::server
