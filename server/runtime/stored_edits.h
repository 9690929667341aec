#pragma once

#include <cstdint>

namespace limber::server {

/// The edits of a session that come after its newest checkpoint: when the next one is worth its
/// writing. One thread at a time.
class StoredEdits {
 public:
  /// An edit was given to the store.
  void note_edit(std::uint64_t bytes) {
    ++count_;
    bytes_ += bytes;
  }
  /// @param every  edits, > 0
  [[nodiscard]] bool is_due(std::uint64_t every) const {
    if (is_being_written_ || count_ < every + put_off_) return false;
    // A large one is worth it behind as many bytes of edits, or behind many edits.
    return bytes_ >= checkpoint_bytes_ / kShare || count_ >= kManyTimes * every;
  }
  void begin_checkpoint() { is_being_written_ = true; }
  /// It was written, up to what begin_checkpoint() saw. @param edits, edit_bytes  of then
  void note_checkpoint(std::uint64_t bytes, std::uint64_t edits, std::uint64_t edit_bytes) {
    checkpoint_bytes_ = bytes;
    count_ -= edits;
    bytes_ -= edit_bytes;
    put_off_ = 0;
    is_being_written_ = false;
  }
  /// There was none: again behind so many more edits.
  void put_off(std::uint64_t edits) {
    put_off_ += edits;
    is_being_written_ = false;
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  static constexpr std::uint64_t kShare = 8, kManyTimes = 10;

  std::uint64_t count_ = 0, bytes_ = 0;
  std::uint64_t checkpoint_bytes_ = 0;
  std::uint64_t put_off_ = 0;
  bool is_being_written_ = false;
};

}  // namespace limber::server
