#include "engine/session/linkages/design_job.h"

#include <utility>

#include "engine/base/error.h"
#include "engine/session/linkages/design_reach.h"

namespace limber::session {

void DesignJob::demand_active() const {
  if (!is_active() || stop_.requested())
    throw Error(ErrorCode::kFailedPrecondition, "", "no design is running");
}

void DesignJob::begin(DesignRequest request, std::uint64_t tag) {
  if (is_active())
    throw Error(ErrorCode::kFailedPrecondition, "", "a design is running: stop or take it first");
  stop_ = Cancellation();
  paused_ = false;
  changed_.reset();
  best_.reset();
  goal_ = request.goal;
  auto info = std::make_shared<DesignInfo>();
  info->tag = tag;
  info->max_iterations = request.max_iterations;
  info->goal = goal_;
  info->smallest_angle_allowed = request.smallest_angle;
  info->variables = request.variables;
  info->guard = request.guard;
  info->flat_angle = request.flat_angle;
  info->least_cover = request.least_cover;
  info_ = std::move(info);
  order_ = Order{std::move(request), tag, stop_};
}

void DesignJob::change(const DesignChange& change, const Eigen::Matrix3Xd& joints) {
  demand_active();
  DesignGoal goal = goal_;
  change.apply_to(goal);
  goal.validate(static_cast<int>(joints.cols()));
  demand_near(goal, joints);
  goal_ = goal;
  if (order_) {
    order_->request.goal = std::move(goal);
  } else {
    changed_ = std::move(goal);
  }
  woken_.notify_all();
}

void DesignJob::pause() {
  demand_active();
  paused_ = true;
}

void DesignJob::resume() {
  demand_active();
  paused_ = false;
  woken_.notify_all();
}

void DesignJob::stop() {
  demand_active();
  stop_any();
}

void DesignJob::stop_any() {
  stop_.request();
  woken_.notify_all();
}

void DesignJob::note_taken(Revision revision) {
  auto info = std::make_shared<DesignInfo>(*info_);
  info->taken = revision;
  info_ = std::move(info);
}

DesignJob::Order DesignJob::take_order() {
  LIMBER_DEMAND(order_.has_value());
  Order order = std::move(*order_);
  order_.reset();
  running_ = true;
  return order;
}

void DesignJob::note(std::shared_ptr<const DesignInfo> info,
                     std::shared_ptr<const DesignCandidate> best) {
  info_ = std::move(info);
  best_ = std::move(best);
}

/// A design that was taken meanwhile stays so.
void DesignJob::end(DesignInfo info) {
  if (info_ && info_->taken) info.taken = info_->taken;
  info.state = DesignState::kEnded;
  info_ = std::make_shared<const DesignInfo>(std::move(info));
  running_ = paused_ = false;
}

void DesignJob::wait(std::unique_lock<std::mutex>& lock) {
  LIMBER_DEMAND(lock.mutex() == &mutex_);
  woken_.wait(lock, [this] { return stop_.requested() || changed_ || !paused_; });
}

}  // namespace limber::session
