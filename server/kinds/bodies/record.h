#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/session/bodies/session.h"
#include "server/runtime/export_book.h"
#include "server/runtime/record.h"

namespace limber::server {

/// @throws Error{kFailedPrecondition} until the session's model is built
[[nodiscard]] std::shared_ptr<const session::Geometry> geometry_of(
    const session::BodySession& session);

/// The record of a session of an elastic body, and the session's listener.
class SessionRecord final : public Record, public session::BodyListener {
 public:
  /// What the open request said, for answers that need no session.
  struct Opened {
    std::string id, name;
    proto::MeshSource mesh_source;  // where it is short enough to be told again (path, sample)
    int nodes = 0, tets = 0, frames = 0;
    double length_unit = 1;
    int lanes = 0;            // modes the scene asks for
    int keyframe_rows = 0;    // of the solver, at most
    std::uint64_t bytes = 0;  // estimated memory without constraints and keyframes
  };
  SessionRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job);

  /// Right after the session is made. Before, answers come from `Opened` alone.
  void attach(std::shared_ptr<session::BodySession> session);
  /// The session, for calls. @throws Error{kNotFound} once it is closed
  [[nodiscard]] std::shared_ptr<session::BodySession> session() const;

  [[nodiscard]] const Opened& opened() const { return opened_; }
  [[nodiscard]] const char* subject() const override { return "an elastic body"; }
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const std::string& known_basis_hash) const override;
  /// An edit went through: how many constraints there are now.
  void constraints_changed(std::size_t count);
  [[nodiscard]] std::size_t constraint_count() const;
  /// @throws Refusal LIMIT_EXCEEDED if so many constraints and keyframes would take the session
  /// beyond its memory
  void demand_memory(std::size_t constraints, std::size_t keyframes) const;

  /// The final result that contains `solve_cold(job)` ends this job.
  void expect_cold(JobId job);
  /// What exports are made of.
  [[nodiscard]] ExportBook<session::BodyResult>& exports() { return exports_; }

  void stop_work() override { session()->cancel(); }
  void close_session() override;

  void on_progress(const session::Progress& progress) override { note_progress(progress); }
  void on_state(session::State state, const std::string& message) override {
    note_state(state, message);
  }
  void on_result(const std::shared_ptr<const session::BodyResult>& result) override;

 private:
  void describe(proto::SessionStatus& status) const override;
  void adopt_model() override;
  [[nodiscard]] bool is_attached() const override { return session_ != nullptr; }
  void take_ended_jobs(std::vector<JobId>& jobs) override;

  const Opened opened_;
  ExportBook<session::BodyResult> exports_;

  // Under the lock:
  std::shared_ptr<session::BodySession> session_;
  std::shared_ptr<const session::Geometry> geometry_;  // once the model is adopted
  std::shared_ptr<const session::BodyResult> newest_;
  std::size_t constraints_ = 0;
  std::optional<proto::ModelInfo> model_;
};

}  // namespace limber::server
