#pragma once

#include <memory>
#include <string>

#include "engine/session/beams/session.h"
#include "server/kinds/beams/structure.h"
#include "server/runtime/export_book.h"
#include "server/runtime/record.h"

namespace limber::server {

/// The record of a session of a structure of beams, and the session's listener.
class BeamRecord final : public Record, public session::BeamListener {
 public:
  static constexpr std::size_t kLightElements = 2000;  // an edit of one load takes 2 ms

  /// @param opened  as it was opened: what answers need that the session does not keep
  BeamRecord(Hub& hub, SessionKey key, DecodedBeams opened, JobId open_job);

  /// Right after the session is made. Before, answers come from what was opened alone.
  void attach(std::shared_ptr<session::BeamSession> session);
  /// The session, for calls. @throws Error{kNotFound} once it is closed
  [[nodiscard]] std::shared_ptr<session::BeamSession> session() const;

  [[nodiscard]] const DecodedBeams& opened() const { return opened_; }
  /// What exports are made of: final results.
  [[nodiscard]] ExportBook<session::BeamResult>& exports() { return exports_; }
  [[nodiscard]] const char* subject() const override { return "a structure of beams"; }
  /// An edit validates the whole structure.
  [[nodiscard]] bool edits_are_light() const override {
    return opened_.model.elements.size() <= kLightElements;
  }
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const std::string& known_basis_hash) const override;
  /// @throws Error{kFailedPrecondition, "session"} while there is none
  [[nodiscard]] std::shared_ptr<const session::BeamResult> final_result() const;
  void stop_work() override { session()->cancel(); }
  void close_session() override;

  void on_state(session::State state, const std::string& message) override {
    note_state(state, message);
  }
  void on_result(const std::shared_ptr<const session::BeamResult>& result) override;

 private:
  void describe(proto::SessionStatus& status) const override;
  void adopt_model() override {}  // frames need none
  [[nodiscard]] bool is_attached() const override { return session_ != nullptr; }

  const DecodedBeams opened_;
  ExportBook<session::BeamResult> exports_;
  std::shared_ptr<session::BeamSession> session_;  // under the lock
};

}  // namespace limber::server
