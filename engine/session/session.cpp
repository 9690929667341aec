#include "engine/session/session.h"

#include "engine/session/session_impl.h"

namespace limber::session {

Session::Session(std::string id, scene::Scene scene, SessionOptions options,
                 std::shared_ptr<ModelCache> cache, Executor executor,
                 std::shared_ptr<Listener> listener)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(scene), options, std::move(cache),
                                   std::move(executor), std::move(listener))) {
  impl_->open();
}

Session::~Session() { impl_->shut(Impl::Farewell::kSilent); }

const std::string& Session::id() const { return impl_->id_; }

State Session::state() const {
  return impl_->read([](const Impl& impl) { return impl.state_; });
}

std::string Session::state_message() const {
  return impl_->read([](const Impl& impl) { return impl.message_; });
}

Progress Session::progress() const {
  return impl_->read([](const Impl& impl) { return impl.progress_; });
}

Revision Session::revision() const {
  return impl_->read([](const Impl& impl) { return impl.document_.revision(); });
}

scene::Scene Session::scene() const { return impl_->scene(); }

scene::Dynamics Session::dynamics() const {
  return impl_->read([](const Impl& impl) { return impl.document_.dynamics(); });
}

scene::MaterialVariables Session::material_variables() const {
  return impl_->read([](const Impl& impl) { return impl.document_.material().variables; });
}

std::vector<scene::Constraint> Session::constraints() const {
  return impl_->read([](const Impl& impl) { return impl.document_.constraint_list(); });
}

std::vector<scene::Keyframe> Session::keyframes() const {
  return impl_->read([](const Impl& impl) { return impl.document_.keyframe_list(); });
}

std::shared_ptr<const scene::Scene> Session::unedited() const {
  return impl_->read([](const Impl& impl) { return impl.document_.unedited(); });
}

EditReceipt Session::edit(const std::vector<Edit>& edits, std::optional<Revision> expected) {
  return impl_->edit(edits, expected);
}

void Session::solve_cold(std::uint64_t request) { impl_->solve_cold(request); }

void Session::cancel() { impl_->cancel(); }

void Session::close() { impl_->shut(Impl::Farewell::kSaid); }

std::shared_ptr<const Result> Session::newest_result() const {
  return impl_->read([](const Impl& impl) { return impl.newest_; });
}

std::shared_ptr<const Result> Session::converged_result() const {
  return impl_->read([](const Impl& impl) { return impl.converged_; });
}

std::shared_ptr<const Geometry> Session::geometry() const {
  const auto built = impl_->read([](const Impl& impl) { return impl.built_; });
  return built ? std::shared_ptr<const Geometry>(built, &built->geometry) : nullptr;
}

std::shared_ptr<const reduced::ReducedModel> Session::model() const {
  const auto built = impl_->read([](const Impl& impl) { return impl.built_; });
  return built ? built->model : nullptr;
}

std::string Session::model_message() const {
  const auto built = impl_->read([](const Impl& impl) { return impl.built_; });
  return built ? built->message : std::string();
}

double Session::build_seconds() const {
  const auto built = impl_->read([](const Impl& impl) { return impl.built_; });
  return built ? built->seconds : 0;
}

bool Session::model_from_cache() const {
  const auto built = impl_->read([](const Impl& impl) { return impl.built_; });
  return built && built->from_cache;
}

Eigen::MatrixXd Session::positions(const Result& result, int first_frame, int frame_count) const {
  return impl_->positions(result, first_frame, frame_count);
}

}  // namespace limber::session
