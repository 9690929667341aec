#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/session/linkage/linkage_session_impl.h"

namespace limber::session {
namespace {

std::shared_ptr<const Eigen::MatrixXf> shape_columns(const std::vector<Eigen::VectorXf>& path) {
  auto frames = std::make_shared<Eigen::MatrixXf>(path.empty() ? 0 : path[0].size(),
                                                  static_cast<Eigen::Index>(path.size()));
  for (std::size_t i = 0; i < path.size(); ++i) frames->col(static_cast<Eigen::Index>(i)) = path[i];
  return frames;
}

}  // namespace

void LinkageSession::Impl::say_closed() {
  tell(listener_.get(), [](LinkageListener& listener) { listener.on_state(State::kClosed, ""); });
}

void LinkageSession::Impl::run() {
  if (!task_.begin()) return;
  try {
    if (live_ || build()) {
      for (;;) {
        const Work work = next_work();
        if (const auto* const round = std::get_if<Round>(&work)) {
          solve(*round);
        } else if (const auto* const design = std::get_if<DesignRound>(&work)) {
          run_design(*design);
        } else {
          return;
        }
      }
    }
    task_.finish(std::unique_lock(mutex_));
  } catch (...) {  // out of memory between rounds: what was accepted waits for the next call
    std::unique_lock lock(mutex_);
    work_ = true;
    task_.finish(std::move(lock));
  }
}

bool LinkageSession::Impl::build() {
  std::string message;
  try {
    const auto tell_progress = [this](const std::string& stage, double fraction) {
      tell(listener_.get(), [&](LinkageListener& listener) {
        listener.on_progress({stage, fraction});
      });
    };
    tell_progress("linkage", 0);
    live_ = std::make_unique<LiveLinkage>(linkage_, JobContext{building_, tell_progress});
    auto geometry = std::make_shared<const LinkageGeometry>(describe());
    bool open = false;
    {
      const std::lock_guard lock(mutex_);
      geometry_ = std::move(geometry);
      shape_ = std::make_shared<const LinkageShape>(live_->shape());
      open = !task_.is_closed();
      if (open) state_ = State::kReady;
    }
    if (open)
      tell(listener_.get(),
           [](LinkageListener& listener) { listener.on_state(State::kReady, ""); });
    return true;
  } catch (const Error& error) {
    message =
        error.field().empty() ? error.what() : fmt::format("{}: {}", error.field(), error.what());
  } catch (const std::exception& error) {
    message = error.what();
  } catch (...) {
    message = "unknown exception";
  }
  live_.reset();
  bool open = false;
  {
    const std::lock_guard lock(mutex_);
    open = !task_.is_closed();
    if (open) {
      state_ = State::kFailed;
      message_ = message;
    }
  }
  if (open)
    tell(listener_.get(),
         [&](LinkageListener& listener) { listener.on_state(State::kFailed, message); });
  return false;
}

LinkageGeometry LinkageSession::Impl::describe() const {
  const rods::LinkageModel& model = live_->model();
  const LinkageShape& shape = live_->shape();
  LinkageGeometry geometry;
  geometry.coordinates = shape.size();
  geometry.outline = shape.outline();
  geometry.surface = shape.triangles();
  geometry.surface_nodes = shape.surface_nodes();
  const auto& segments = model.graph().segments;
  geometry.joints_of_segment.resize(2, static_cast<Eigen::Index>(segments.size()));
  for (std::size_t s = 0; s < segments.size(); ++s) {
    geometry.edges.push_back(model.variables().edges(static_cast<int>(s)));
    geometry.joints_of_segment.col(static_cast<Eigen::Index>(s)) << segments[s].joints[0],
        segments[s].joints[1];
  }
  for (const auto& joint : model.graph().joints) geometry.vertex_of_joint.push_back(joint.vertex);
  return geometry;
}

/// Designs come after what was edited before. Nothing to do: the task ends, in the same breath.
LinkageSession::Impl::Work LinkageSession::Impl::next_work() {
  std::unique_lock lock(mutex_);
  if (!task_.is_closed() && work_) return next_round();
  if (!task_.is_closed() && desk_.is_waiting()) {
    designed_ = document_.conditions();
    return DesignRound{desk_.take_order(), document_.revision(), designed_};
  }
  task_.finish(std::move(lock));
  return {};
}

/// Called with the lock.
LinkageSession::Impl::Round LinkageSession::Impl::next_round() {
  round_ = Cancellation();
  if (!first_.empty()) {
    Round round = std::move(first_.front());
    first_.pop_front();
    round.cancellation = round_;
    taken_ = round.revision;
    must_finish_ = true;
    return round;
  }
  work_ = must_finish_ = false;
  if (cancelled_) round_.request();
  taken_ = document_.revision();
  return {taken_, document_.conditions(),      edited_at_,
          round_, std::exchange(lessons_, {}), document_.steps_before_return()};
}

void LinkageSession::Impl::solve(const Round& round) {
  published_at_ = Clock::now();
  LiveLinkage::Outcome outcome;
  try {
    for (const Lesson& lesson : round.lessons)
      live_->learn(lesson.conditions, lesson.candidate->deployed);
    outcome = live_->solve(
        round.conditions, JobContext{round.cancellation, {}}, [&] { publish_iterate(round); },
        round.origins);
  } catch (const std::exception& error) {
    live_->restore();
    outcome.report.status = rods::EquilibriumStatus::kStalled;
    outcome.report.message = error.what();
  }
  const bool interrupted = read([](const Impl& impl) {
    return impl.task_.is_closed() || (impl.work_ && !impl.must_finish_);
  });
  const bool cancelled = outcome.report.status == rods::EquilibriumStatus::kCancelled;
  if (cancelled && interrupted) {  // a newer revision goes on from this iterate
    live_->stay_near();
    return;
  }
  if (cancelled) live_->restore();
  auto result = std::make_shared<LinkageResult>();
  result->converged = true;
  result->solve_failed = !outcome.reached && !cancelled;
  result->report = outcome.reached ? outcome.report : live_->report_of_shape(outcome.report);
  const bool moved = !cancelled && !outcome.path.empty();
  if (moved) result->path = std::move(outcome.path);
  result->frames = moved ? shape_columns(outcome.frames) : shape_columns({shape_now()});
  result->strains = moved ? shape_columns(outcome.strains)
                          : shape_columns({live_->statics()->strains(live_->state())});
  result->statics = live_->statics();
  result->state = std::make_shared<const rods::LinkageState>(live_->state());
  result->conditions =
      std::make_shared<const scene::LinkageConditions>(live_->conditions_of_shape());
  hand_out(std::move(result), round);
}

void LinkageSession::Impl::publish_iterate(const Round& round) {
  const auto now = Clock::now();
  if (now - published_at_ < kPublishInterval) return;
  published_at_ = now;
  auto result = std::make_shared<LinkageResult>();
  result->frames = shape_columns({shape_now()});
  hand_out(std::move(result), round);
}

Eigen::VectorXf LinkageSession::Impl::shape_now() const {
  return live_->shape().coordinates(live_->model(), live_->state());
}

void LinkageSession::Impl::hand_out(std::shared_ptr<LinkageResult> result, const Round& round) {
  result->revision = round.revision;
  if (!result->design) {
    result->mean_angle = live_->state().mean_opening_angle();
    result->section_scales = live_->model().section_scales();
  }
  result->since_edit_ms = round.since_edit_ms();
  std::shared_ptr<const LinkageResult> older, older_final;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed() || (result->design && desk_.is_stopping())) return;
    result->sequence = ++sequence_;
    older = std::exchange(newest_, result);
    if (result->converged) older_final = std::exchange(final_, result);
  }
  tell(listener_.get(), [&](LinkageListener& listener) { listener.on_result(result); });
}

}  // namespace limber::session
