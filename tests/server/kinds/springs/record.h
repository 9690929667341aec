#pragma once

#include <memory>
#include <string>

#include "server/runtime/session_record.h"
#include "tests/engine/session/springs/session.h"

namespace limber::server::springs {

/// The record of a session of a chain of springs.
class ChainRecord final
    : public SessionRecord<session::springs::SpringSession, session::springs::SpringListener> {
 public:
  ChainRecord(Hub& hub, const SessionKey& key, std::string name, session::springs::Chain opened,
              JobId open_job);

  [[nodiscard]] const char* kind() const override { return "springs"; }
  [[nodiscard]] const char* subject() const override { return "a chain of springs"; }
  [[nodiscard]] proto::EditResponse edit(const proto::EditRequest& request,
                                         const session::Author& author) override;
  void add_scene(const proto::GetSessionRequest& request,
                 proto::GetSessionResponse& response) const override;
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest& request) const override;
  /// EXPORT_FORMAT_SCENE: the chain as edited.
  [[nodiscard]] proto::ExportResponse export_part(const proto::ExportRequest& request) override;

  void on_result(const std::shared_ptr<const session::springs::SpringResult>& result) override;

 private:
  [[nodiscard]] const google::protobuf::Message* edit_extension() const override;
  void describe(proto::SessionStatus& status) const override;
  [[nodiscard]] proto::Scene edited_scene() const;

  const std::string name_;
  const session::springs::Chain opened_;
};

}  // namespace limber::server::springs
