#pragma once

#include <memory>

#include "server/runtime/record.h"

namespace limber::server {

/// Bounds what the store has of sessions that are edited for long: behind every
/// StoreOptions::checkpoint_edits edits of a session, what they have made of it is stored in their
/// place. Nobody waits for that. Thread-safe.
class Checkpoints {
 public:
  explicit Checkpoints(Hub& hub) : hub_(hub) {}

  /// The session has got an edit, which was given to the store. With edit_order().
  void note_edit(Record& record);

 private:
  static void write(Hub& hub, Record& record);

  Hub& hub_;
};

}  // namespace limber::server
