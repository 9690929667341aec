#pragma once

#include <memory>
#include <string>

#include "engine/session/linkages/session.h"
#include "server/runtime/export_book.h"
#include "server/runtime/session_record.h"
#include "server/wire/paths.h"

namespace limber::server {

/// The record of a session of a rod linkage.
class LinkageRecord final
    : public SessionRecord<session::LinkageSession, session::LinkageListener> {
 public:
  /// Data of the open request, for answers that need no session.
  struct Opened {
    std::string id, name;
    proto::LineSource lines;  // where it is short enough to be sent back (path, sample)
    int joints = 0, segments = 0;
    double length_unit = 1;
    PathResolver resolve = {};  // of files that designs name
  };
  LinkageRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job);

  [[nodiscard]] const Opened& opened() const { return opened_; }
  /// Ids of jobs of designs, and their ends.
  [[nodiscard]] JobRegistry& jobs() { return hub_.jobs; }
  /// Final results, the source of exports.
  [[nodiscard]] ExportBook<session::LinkageResult>& exports() { return exports_; }
  [[nodiscard]] const char* kind() const override { return "linkages"; }
  [[nodiscard]] const char* subject() const override { return "a rod linkage"; }
  [[nodiscard]] proto::EditResponse edit(const proto::EditRequest& request,
                                         const session::Author& author) override;
  void add_scene(const proto::GetSessionRequest& request,
                 proto::GetSessionResponse& response) const override;
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest& request) const override;
  [[nodiscard]] proto::ExportResponse export_part(const proto::ExportRequest& request) override;
  /// A design that was taken is written out as edits.
  [[nodiscard]] std::optional<proto::EditRequest> made_edits(
      const proto::Request& request) const override;
  [[nodiscard]] bool add_start(proto::Scene& scene) const override;
  [[nodiscard]] CheckpointWriter checkpoint() const override;
  void begin_at(const proto::StoredCheckpoint& checkpoint) override;
  /// Designs.
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply) override;

  void on_result(const std::shared_ptr<const session::LinkageResult>& result) override;
  /// Publishes it, and reports its job.
  void on_design(const std::shared_ptr<const session::DesignInfo>& info) override;

 private:
  /// A design that was taken.
  [[nodiscard]] proto::EditRequest own_edits(std::uint64_t revision) const override;
  void describe(proto::SessionStatus& status) const override;
  void adopt_model() override;
  /// A design that runs, waits or was not taken is not stored.
  [[nodiscard]] bool is_at_rest() const override;
  void welcome_more(const std::string& prefix) override;
  void note_closed(session::LinkageSession& session) override;
  void publish_design(const session::DesignInfo& info);

  const Opened opened_;
  const std::string design_topic_;
  ExportBook<session::LinkageResult> exports_;

  // Under the lock:
  bool is_ready_ = false;  // the model is adopted
  std::shared_ptr<const session::LinkageResult> newest_;
  std::shared_ptr<const session::DesignInfo> design_;
};

}  // namespace limber::server
