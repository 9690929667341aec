#include "engine/session/bodies/session.h"

#include <algorithm>
#include <numbers>

#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/impl.h"

namespace limber::session {

BodySession::BodySession(std::string id, scene::Scene scene, SessionOptions options,
                         std::shared_ptr<ModelCache> cache, Executor executor,
                         std::shared_ptr<BodyListener> listener)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(scene), options, std::move(cache),
                                   std::move(executor), std::move(listener))) {
  impl_->open();
}

BodySession::~BodySession() { impl_->shut(Impl::CloseNotification::kNone); }

const std::string& BodySession::id() const { return impl_->id(); }

State BodySession::state() const { return impl_->state(); }

std::string BodySession::state_message() const { return impl_->message(); }

Progress BodySession::progress() const { return impl_->progress(); }

Revision BodySession::revision() const {
  return impl_->read([this] { return impl_->document().revision(); });
}

scene::Scene BodySession::scene() const { return impl_->scene(); }
scene::Scene BodySession::scene_without_base_motion() const {
  return impl_->scene(Impl::BaseMotionPart::kLeftOut);
}

PinPaths BodySession::pins() const {
  return impl_->read([this] { return impl_->document().pins(); });
}

scene::Dynamics BodySession::dynamics() const {
  return impl_->read([this] { return impl_->document().dynamics(); });
}

scene::MaterialVariables BodySession::material_variables() const {
  return impl_->read([this] { return impl_->document().material().variables; });
}

std::vector<scene::Constraint> BodySession::constraints() const {
  return impl_->read([this] { return impl_->document().constraint_list(); });
}

std::vector<scene::Keyframe> BodySession::keyframes() const {
  return impl_->read([this] { return impl_->document().keyframe_list(); });
}

std::shared_ptr<const scene::Scene> BodySession::unedited() const {
  return impl_->read([this] { return impl_->document().unedited(); });
}

EditReceipt BodySession::edit(const std::vector<BodyEdit>& edits, std::optional<Revision> expected,
                              const Author& author) {
  return impl_->edit(edits, expected, author);
}

Document::Checkpoint BodySession::checkpoint() const {
  return impl_->read([this] { return impl_->document().checkpoint(); });
}

void BodySession::demand_reachable(const Document::Checkpoint& checkpoint) const {
  impl_->demand_reachable(checkpoint);
}

void BodySession::begin_at(const Document::Checkpoint& checkpoint) { impl_->begin_at(checkpoint); }

void BodySession::solve_cold(std::uint64_t request) { impl_->solve_cold(request); }

void BodySession::cancel() { impl_->cancel(); }

void BodySession::look_at(spacetime::FrameSpan frames) { impl_->look_at(frames); }

void BodySession::close() { impl_->shut(Impl::CloseNotification::kSent); }

std::shared_ptr<const BodyResult> BodySession::newest_result() const {
  return impl_->newest_result();
}

std::shared_ptr<const BodyResult> BodySession::final_result() const {
  return impl_->final_result();
}

std::shared_ptr<const Geometry> BodySession::geometry() const {
  return impl_->read([this]() -> std::shared_ptr<const Geometry> {
    return impl_->shown().empty() ? nullptr : impl_->shown().back()->geometry;
  });
}

std::shared_ptr<const Geometry> BodySession::geometry(const std::string& basis_hash) const {
  return impl_->read([&]() -> std::shared_ptr<const Geometry> {
    for (const auto& shown : impl_->shown())
      if (shown->geometry->basis_hash == basis_hash) return shown->geometry;
    return nullptr;
  });
}

std::shared_ptr<const reduced::ReducedModel> BodySession::model() const {
  const auto built = impl_->read([this] { return impl_->built(); });
  return built ? built->model : nullptr;
}

std::string BodySession::model_message() const {
  const auto built = impl_->read([this] { return impl_->built(); });
  return built ? built->message : std::string();
}

double BodySession::build_seconds() const {
  const auto built = impl_->read([this] { return impl_->built(); });
  return built ? built->seconds : 0;
}

bool BodySession::model_from_cache() const {
  const auto built = impl_->read([this] { return impl_->built(); });
  return built && built->from_cache;
}

ModeChoice BodySession::mode_choice() const {
  return impl_->read([this] { return impl_->mode_choice(); });
}

std::optional<FirstPictureInfo> BodySession::first_picture() const {
  return impl_->read([this] { return impl_->first_picture(); });
}

Eigen::MatrixXd BodySession::positions(const BodyResult& result, int first_frame,
                                       int frame_count) const {
  return impl_->positions(result, first_frame, frame_count);
}

CandidateModes BodySession::candidate_modes() const {
  const auto built = impl_->read([this] { return impl_->built(); });
  if (!built) throw Error(ErrorCode::kFailedPrecondition, "session", "the model is not built yet");
  const reduced::ReducedModel& model = *built->model;
  const Eigen::ArrayXd stiffness = model.eigenvalues.array().max(0);
  return {source_displacements(*unedited(), *built->compact_of_source, model.modes),
          (stiffness.sqrt() / (2 * std::numbers::pi)).matrix()};
}

}  // namespace limber::session
