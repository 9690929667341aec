#pragma once

#include <memory>
#include <string>
#include <utility>

#include "server/runtime/record.h"
#include "server/wire/edits.h"
#include "server/wire/fields.h"

namespace limber::server {

/// For requests that need the model.
[[nodiscard]] inline Error model_not_built() {
  return {ErrorCode::kFailedPrecondition, "session", "the model is not built yet"};
}

/// A record with its session, and the session's listener.
/// @tparam Session  cancel(), close()
/// @tparam Listener  session::Listener of its results, or a subclass
template <class Session, class Listener>
class SessionRecord : public Record, public Listener {
 public:
  using Record::Record;

  /// Right after the session is made. Before, answers come from the opened scene alone.
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
    if (!session) refuse_closed();
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

  /// The newest result, or the newest final one.
  /// @throws Error{kFailedPrecondition, "session"} while there is none, {kNotFound} once it is
  /// closed
  [[nodiscard]] auto demand_result(bool final_only) const {
    const auto session = this->session();
    auto result = final_only ? session->final_result() : session->newest_result();
    if (!result) {
      throw Error(ErrorCode::kFailedPrecondition, "session",
                  final_only ? "there is no final result yet" : "there is no result yet");
    }
    return result;
  }

  std::uint64_t first_sequence() override { return last_sequence_; }
  void on_progress(const session::Progress& progress) override { note_progress(progress); }
  void on_state(session::State state, const std::string& message) override {
    note_state(state, message);
  }

 protected:
  /// Makes the edits of a request. Errors and warnings of the session are at fields of the request.
  template <class Edits>
  session::EditReceipt make_edits(const proto::EditRequest& request, const Edits& edits,
                                  const session::Author& author) {
    const auto session = this->session();
    const auto rename = [&](const std::string& field) {
      return edit_field_in(request, field, edit_extension());
    };
    session::EditReceipt receipt = with_fields(
        rename, [&] { return session->edit(edits, expected_revision(request), author); });
    for (auto& issue : receipt.issues) issue.field = rename(issue.field);
    return receipt;
  }
  /// For kinds that limber.v1 does not know: the message type of their edits.
  [[nodiscard]] virtual const google::protobuf::Message* edit_extension() const { return nullptr; }

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
