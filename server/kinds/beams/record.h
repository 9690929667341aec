#pragma once

#include <memory>
#include <string>

#include "engine/session/beams/session.h"
#include "server/kinds/beams/structure.h"
#include "server/runtime/export_book.h"
#include "server/runtime/session_record.h"

namespace limber::server {

/// The record of a session of a structure of beams.
class BeamRecord final : public SessionRecord<session::BeamSession, session::BeamListener> {
 public:
  static constexpr std::size_t kLightElements = 2000;  // an edit of one load takes 2 ms

  /// @param opened  as it was opened: what answers need that the session does not keep
  BeamRecord(Hub& hub, SessionKey key, DecodedBeams opened, JobId open_job);

  [[nodiscard]] const DecodedBeams& opened() const { return opened_; }
  /// Final results, the source of exports.
  [[nodiscard]] ExportBook<session::BeamResult>& exports() { return exports_; }
  [[nodiscard]] const char* kind() const override { return "beams"; }
  [[nodiscard]] const char* subject() const override { return "a structure of beams"; }
  /// An edit validates the whole structure.
  [[nodiscard]] bool edits_are_light() const override {
    return opened_.model.elements.size() <= kLightElements;
  }
  [[nodiscard]] proto::EditResponse edit(const proto::EditRequest& request,
                                         const session::Author& author) override;
  void add_scene(const proto::GetSessionRequest& request,
                 proto::GetSessionResponse& response) const override;
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest& request) const override;
  [[nodiscard]] proto::ExportResponse export_part(const proto::ExportRequest& request) override;
  /// Nodes that were held where they were are written out.
  [[nodiscard]] std::optional<proto::EditRequest> made_edits(
      const proto::Request& request) const override;
  [[nodiscard]] bool add_start(proto::Scene& scene) const override;
  [[nodiscard]] CheckpointWriter checkpoint() const override;
  void begin_at(const proto::StoredCheckpoint& checkpoint) override;
  /// The solution in numbers.
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply) override;

  void on_result(const std::shared_ptr<const session::BeamResult>& result) override;

 private:
  void describe(proto::SessionStatus& status) const override;

  const DecodedBeams opened_;
  ExportBook<session::BeamResult> exports_;
};

}  // namespace limber::server
