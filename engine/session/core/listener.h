#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/session/core/values.h"

namespace limber::session {

/// Notifications to the owner of a session. Called from worker threads, one call at a time per
/// session; must not block. May call any getter.
template <class Result>
class Listener {
 public:
  virtual ~Listener() = default;
  /// Asked once, when the session is made: results are numbered on from here, where it continues
  /// one of before.
  [[nodiscard]] virtual std::uint64_t first_sequence() { return 0; }
  virtual void on_progress(const Progress&) {}  // while building
  virtual void on_state(State state, const std::string& message) = 0;
  virtual void on_result(const std::shared_ptr<const Result>& result) = 0;
  /// Whether anybody would see early frames.
  [[nodiscard]] virtual bool wants_early_frames() { return false; }
  /// Spans of frames of the result that comes next, before it is whole: without a sequence number.
  /// Only for long motions, if the listener accepts them.
  virtual void on_early_frames(const std::vector<std::shared_ptr<const Result>>& /*parts*/) {}
};

/// Calls a listener, if there is one: never with a lock held, since it may call any getter. One
/// that throws does not take the session with it.
template <class Listener, class Call>
void notify(Listener* listener, const Call& call) noexcept {
  if (listener == nullptr) return;
  try {
    call(*listener);
  } catch (...) {
  }
}

}  // namespace limber::session
