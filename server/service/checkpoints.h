#pragma once

#include <memory>

#include "server/runtime/record.h"

namespace limber::server {

/// Bounds the stored data of sessions that are edited for long: every
/// StoreOptions::checkpoint_edits edits of a session, a checkpoint replaces them in the store.
/// Nobody waits for that. Thread-safe.
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
