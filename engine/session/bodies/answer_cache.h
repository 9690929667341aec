#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "engine/session/bodies/session.h"

namespace limber::session {

/// Converged answers by Document::content(), so that undo and redo bring back the motion that was
/// there, not another minimum. The newest so many, within so many bytes; the very newest always.
class AnswerCache {
 public:
  explicit AnswerCache(std::size_t most = 256, std::size_t bytes = std::size_t{64} << 20)
      : most_(most), most_bytes_(bytes) {}

  void keep(std::uint64_t content, std::shared_ptr<const BodyResult> answer);
  /// Null if there is none any more.
  [[nodiscard]] std::shared_ptr<const BodyResult> find(std::uint64_t content) const;

 private:
  struct Entry {
    std::uint64_t content;
    std::shared_ptr<const BodyResult> answer;
  };
  [[nodiscard]] std::deque<Entry>::const_iterator entry_of(std::uint64_t content) const;

  std::size_t most_, most_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Entry> entries_;  // newest last
};

}  // namespace limber::session
