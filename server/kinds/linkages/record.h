#pragma once

#include <memory>
#include <string>

#include "engine/session/linkages/session.h"
#include "server/runtime/export_book.h"
#include "server/runtime/record.h"

namespace limber::server {

/// The record of a session of a rod linkage, and the session's listener.
class LinkageRecord final : public Record, public session::LinkageListener {
 public:
  /// What the open request said, for answers that need no session.
  struct Opened {
    std::string id, name;
    proto::LineSource lines;  // where it is short enough to be told again (path, sample)
    int joints = 0, segments = 0;
    double length_unit = 1;
  };
  LinkageRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job);

  /// Right after the session is made. Before, answers come from `Opened` alone.
  void attach(std::shared_ptr<session::LinkageSession> session);
  /// The session, for calls. @throws Error{kNotFound} once it is closed
  [[nodiscard]] std::shared_ptr<session::LinkageSession> session() const;

  [[nodiscard]] const Opened& opened() const { return opened_; }
  /// What exports are made of: final results.
  [[nodiscard]] ExportBook<session::LinkageResult>& exports() { return exports_; }
  [[nodiscard]] const char* subject() const override { return "a rod linkage"; }
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool final_only) const override;
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const std::string& known_basis_hash) const override;
  void stop_work() override { session()->cancel(); }
  void close_session() override;

  void on_progress(const session::Progress& progress) override { note_progress(progress); }
  void on_state(session::State state, const std::string& message) override {
    note_state(state, message);
  }
  void on_result(const std::shared_ptr<const session::LinkageResult>& result) override;
  /// Its job is told how it stands, and so are those who watch.
  void on_design(const std::shared_ptr<const session::DesignInfo>& info) override;

 private:
  void describe(proto::SessionStatus& status) const override;
  void adopt_model() override;
  void welcome_more(const std::string& prefix) override;
  void publish_design(const session::DesignInfo& info);
  [[nodiscard]] bool is_attached() const override { return session_ != nullptr; }

  const Opened opened_;
  const std::string design_topic_;
  ExportBook<session::LinkageResult> exports_;

  // Under the lock:
  std::shared_ptr<session::LinkageSession> session_;
  std::shared_ptr<const session::LinkageShape> shape_;  // once the model is adopted
  std::shared_ptr<const session::LinkageResult> newest_;
  std::shared_ptr<const session::DesignInfo> design_;
};

}  // namespace limber::server
