#include "engine/session/linkages/session.h"

#include <utility>

#include "engine/session/linkages/impl.h"

namespace limber::session {

LinkageSession::LinkageSession(std::string id, scene::Linkage linkage, LinkageLimits limits,
                               Executor executor, std::shared_ptr<LinkageListener> listener,
                               std::optional<RecalledAnswer> recalled)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(linkage), limits, std::move(executor),
                                   std::move(listener), std::move(recalled))) {
  impl_->open();
}
LinkageSession::~LinkageSession() { impl_->shut(Impl::CloseNotification::kNone); }

const std::string& LinkageSession::id() const { return impl_->id(); }
State LinkageSession::state() const { return impl_->state(); }
std::string LinkageSession::state_message() const { return impl_->message(); }
Revision LinkageSession::revision() const {
  return impl_->read([this] { return impl_->document().revision(); });
}
scene::Linkage LinkageSession::linkage() const {
  scene::Linkage linkage = impl_->opened();
  linkage.conditions = *conditions();
  linkage.edges_per_segment = impl_->read([this] { return impl_->edges_per_segment(); });
  linkage.shape.reset();
  linkage.shape_conditions.reset();
  return linkage;
}
bool LinkageSession::chose_edges() const { return impl_->opened().edges_per_segment == 0; }
scene::Linkage LinkageSession::linkage_in_shape() const {
  scene::Linkage in_shape = linkage();
  const auto result = final_result();
  if (!result) {  // it is where the scene had it, or nowhere yet
    const scene::Linkage& scene = impl_->opened();
    in_shape.shape = scene.shape;
    if (scene.shape) in_shape.shape_conditions = scene.shape_conditions.value_or(scene.conditions);
    return in_shape;
  }
  const rods::LinkageModel& model = result->statics->model();
  in_shape.shape = result->state->numbers(model);
  const auto faults = scene::validate(*result->conditions, model.variables().joints(),
                                      model.variables().segments());
  if (faults.empty()) in_shape.shape_conditions = *result->conditions;
  return in_shape;
}
std::shared_ptr<const scene::LinkageConditions> LinkageSession::conditions() const {
  return impl_->read([this] { return impl_->document().conditions(); });
}
EditReceipt LinkageSession::edit(const std::vector<LinkageEdit>& edits,
                                 std::optional<Revision> expected, const Author& author) {
  return impl_->edit(edits, expected, author);
}
LinkageDocument::Checkpoint LinkageSession::checkpoint() const {
  return impl_->read([this] { return impl_->checkpoint(); });
}
void LinkageSession::demand_reachable(const LinkageDocument::Checkpoint& checkpoint) const {
  impl_->document().demand_reachable(checkpoint);
}
void LinkageSession::begin_at(LinkageDocument::Checkpoint checkpoint) {
  impl_->begin_at(std::move(checkpoint));
}
void LinkageSession::start_design(DesignRequest request, std::uint64_t tag) {
  impl_->start_design(std::move(request), tag);
}
void LinkageSession::change_design(const DesignChange& change) { impl_->change_design(change); }
void LinkageSession::pause_design() {
  impl_->steer_design([](DesignJob& design) { design.pause(); });
}
void LinkageSession::resume_design() {
  impl_->steer_design([](DesignJob& design) { design.resume(); });
}
void LinkageSession::stop_design() {
  impl_->steer_design([this](DesignJob& design) {
    design.stop();
    impl_->stop_design();
  });
}
EditReceipt LinkageSession::take_design(std::optional<Revision> expected) {
  return impl_->take_design(expected);
}
NewestDesign LinkageSession::newest_design() const {
  return impl_->read([this] {
    return NewestDesign{impl_->design().info(), impl_->design().best()};
  });
}
std::shared_ptr<const DesignInfo> LinkageSession::design() const { return newest_design().info; }
std::shared_ptr<const DesignCandidate> LinkageSession::best_design() const {
  return newest_design().best;
}
void LinkageSession::cancel() { impl_->cancel(); }
void LinkageSession::close() { impl_->shut(Impl::CloseNotification::kSent); }
std::shared_ptr<const LinkageResult> LinkageSession::newest_result() const {
  return impl_->newest_result();
}
std::shared_ptr<const LinkageResult> LinkageSession::final_result() const {
  return impl_->final_result();
}
std::shared_ptr<const LinkageGeometry> LinkageSession::geometry() const {
  return impl_->read([this] { return impl_->geometry(); });
}
std::shared_ptr<const LinkageShape> LinkageSession::shape() const {
  return impl_->read([this] { return impl_->shape(); });
}
std::shared_ptr<const LinkageStatics> LinkageSession::statics() const {
  const auto result = final_result();
  return result ? result->statics : nullptr;
}
Eigen::VectorXd LinkageSession::surface(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                        const Eigen::VectorXd& section_scales) const {
  const auto shape = impl_->read([this] { return impl_->shape(); });
  if (!shape) throw Error(ErrorCode::kFailedPrecondition, "", "the linkage is not built yet");
  if (coordinates.size() != shape->size())
    throw Error(ErrorCode::kInvalidArgument, "coordinates", "of another linkage");
  return shape->surface(coordinates, section_scales);
}

}  // namespace limber::session
