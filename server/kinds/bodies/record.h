#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/bodies/session.h"
#include "server/kinds/bodies/carried_surface.h"
#include "server/kinds/bodies/frames.h"
#include "server/runtime/export_book.h"
#include "server/runtime/session_record.h"
#include "server/wire/paths.h"

namespace limber::server {

/// The record of a session of an elastic body.
class BodyRecord final : public SessionRecord<session::BodySession, session::BodyListener> {
 public:
  /// Data of the open request, for answers that need no session.
  struct Opened {
    std::string id, name;
    proto::MeshSource mesh_source;  // where it is short enough to be sent back (path, sample)
    int nodes = 0, tets = 0, frames = 0;
    double length_unit = 1;
    int lanes = 0;              // modes the scene asks for
    int keyframe_rows = 0;      // of the solver, at most
    std::uint64_t bytes = 0;    // estimated memory without constraints and keyframes
    PathResolver resolve = {};  // of files that poses of edits name
    std::shared_ptr<const CarriedSurface> surface = {};  // null: none
  };
  BodyRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job);

  [[nodiscard]] const Opened& opened() const { return opened_; }
  [[nodiscard]] const char* kind() const override { return "bodies"; }
  [[nodiscard]] const char* subject() const override { return "an elastic body"; }
  [[nodiscard]] proto::EditResponse edit(const proto::EditRequest& request,
                                         const session::Author& author) override;
  void add_scene(const proto::GetSessionRequest& request,
                 proto::GetSessionResponse& response) const override;
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest& request) const override;
  [[nodiscard]] proto::ExportResponse export_part(const proto::ExportRequest& request) override;
  [[nodiscard]] bool add_start(proto::Scene& scene) const override;
  [[nodiscard]] CheckpointWriter checkpoint() const override;
  void begin_at(const proto::StoredCheckpoint& checkpoint) override;
  /// Fitted materials, cold solves, explanations.
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply) override;

  /// An edit went through, or the scene was opened: how many constraints there are now.
  void constraints_changed(std::size_t count);
  /// The final result that contains `solve_cold(job)` ends this job.
  void expect_cold(JobId job);

  void on_result(const std::shared_ptr<const session::BodyResult>& result) override;
  [[nodiscard]] bool wants_early_frames() override { return streams_->has_early_viewers(); }
  void on_early_frames(
      const std::vector<std::shared_ptr<const session::BodyResult>>& parts) override;

 private:
  [[nodiscard]] std::shared_ptr<BodyFrames> frames_of(
      std::shared_ptr<const session::BodyResult> result) const;
  void describe(proto::SessionStatus& status) const override;
  void adopt_model() override;
  void take_ended_jobs(std::vector<JobId>& jobs) override;
  [[nodiscard]] std::size_t constraint_count() const;
  enum class Pins { kAsTheyAre, kEdited };
  /// @throws Refusal LIMIT_EXCEEDED if so many constraints and keyframes would take the session
  /// beyond its memory
  void demand_memory(std::size_t constraints, std::size_t keyframes, Pins pins) const;
  [[nodiscard]] proto::GetMaterialResponse material(const proto::GetMaterialRequest& request) const;
  [[nodiscard]] proto::ExplainResponse explanation() const;
  [[nodiscard]] proto::SolveColdResponse solve_cold();
  void look_at(const proto::LookAtRequest& request);

  const Opened opened_;
  ExportBook<session::BodyResult> exports_;

  // Under the lock:
  std::shared_ptr<const session::Geometry> geometry_;  // once the model is adopted
  std::shared_ptr<const session::BodyResult> newest_;
  std::size_t constraints_ = 0;
  std::optional<proto::ModelInfo> model_;
};

}  // namespace limber::server
