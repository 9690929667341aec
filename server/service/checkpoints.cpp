#include "server/service/checkpoints.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <mutex>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "server/log/log.h"

namespace limber::server {

void Checkpoints::note_edit(Record& record) {
  const std::uint64_t every = hub_.store ? hub_.options.store->checkpoint_edits : 0;
  if (every == 0 || !record.stored_edits().is_due(every)) return;
  record.stored_edits().begin_checkpoint();
  boost::asio::post(hub_.request_pool,
                    [&hub = hub_, kept = record.shared_from_this()] { write(hub, *kept); });
}

void Checkpoints::write(Hub& hub, Record& record) {
  const std::uint64_t every = hub.options.store->checkpoint_edits;
  StoredEdits& edits = record.stored_edits();
  proto::StoredCheckpoint checkpoint;
  std::uint64_t count = 0, edit_bytes = 0;
  try {
    Record::CheckpointWriter writer;
    {
      const std::lock_guard order(record.edit_order());
      writer = record.checkpoint();
      if (!writer) return;  // it stays begun: there is never one
      for (auto& maker :
           record.attendance().makers(Attendance::Clock::now(), milliseconds_since_1970()))
        *checkpoint.add_makers() = std::move(maker);
      count = edits.count();
      edit_bytes = edits.bytes();
    }
    writer(checkpoint);
    // The answer to begin in, for the earlier edits.
    (void)record.keep_answer_now();
    std::string bytes = checkpoint.SerializeAsString();
    const std::uint64_t size = bytes.size();
    if (size == 0 || size != checkpoint.ByteSizeLong())
      throw Error(ErrorCode::kLimitExceeded, "", "the checkpoint is too large for one message");
    hub.store->keep_checkpoint({record.key().uid, checkpoint.revision(), std::move(bytes)});
    const std::lock_guard order(record.edit_order());
    edits.note_checkpoint(size, count, edit_bytes);
  } catch (const std::exception& fault) {
    const auto* const error = dynamic_cast<const Error*>(&fault);
    // Closed meanwhile, or an answer is to come first; else all its edits stay stored for good.
    const bool is_usual = error != nullptr && (error->code() == ErrorCode::kNotFound ||
                                               error->code() == ErrorCode::kFailedPrecondition);
    log::write(is_usual ? log::Level::kDebug : log::Level::kWarn,
               fmt::format("session {} keeps its edits: {}", record.id(), fault.what()),
               {{"session", record.id()}, {"error", fault.what()}});
    const std::lock_guard order(record.edit_order());
    edits.put_off(1 + every / 4);
  }
}

}  // namespace limber::server
