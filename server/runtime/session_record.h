#pragma once

#include <memory>
#include <string>
#include <utility>

#include "server/runtime/record.h"

namespace limber::server {

/// A record with its session, and the session's listener.
/// @tparam Session  cancel(), close()
/// @tparam Listener  session::Listener of its results, or a subclass
template <class Session, class Listener>
class SessionRecord : public Record, public Listener {
 public:
  using Record::Record;

  /// Right after the session is made. Before, answers come from what was opened alone.
  void attach(std::shared_ptr<Session> session) {
    bool ready = false;
    {
      const std::lock_guard lock(mutex_);
      session_ = std::move(session);
      ready = state_ == session::State::kReady;
    }
    if (ready) adopt_model();  // it was quicker than this call: on_state() found no session to ask
  }

  /// The session, for calls. @throws Error{kNotFound} once it is closed
  [[nodiscard]] std::shared_ptr<Session> session() const {
    auto session = attached_session();
    if (!session) throw closed();
    return session;
  }

  void stop_work() override { session()->cancel(); }
  void close_session() override {
    session()->close();
    std::shared_ptr<Session> gone;  // freed without the lock
    {
      const std::lock_guard lock(mutex_);
      gone = std::exchange(session_, nullptr);
    }
    if (gone) note_closed(*gone);
  }

  void on_progress(const session::Progress& progress) override { note_progress(progress); }
  void on_state(session::State state, const std::string& message) override {
    note_state(state, message);
  }

 protected:
  /// Null before it is attached, and once it is closed.
  [[nodiscard]] std::shared_ptr<Session> attached_session() const {
    const std::lock_guard lock(mutex_);
    return session_;
  }
  [[nodiscard]] bool is_attached() const override { return session_ != nullptr; }
  void adopt_model() override {}
  /// The session has closed. Called once, without the lock.
  virtual void note_closed(Session&) {}

 private:
  std::shared_ptr<Session> session_;  // under the lock
};

}  // namespace limber::server
