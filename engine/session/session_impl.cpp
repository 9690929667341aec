#include "engine/session/session_impl.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "engine/session/geometry.h"

namespace limber::session {
namespace {

scene::Scene validated(scene::Scene scene) {
  for (const scene::Issue& issue : scene::validate(scene)) {
    if (issue.severity == scene::Issue::Severity::kError) {
      throw Error(issue.code, issue.field, issue.message);
    }
  }
  return scene;
}

}  // namespace

Session::Impl::Impl(std::string id, scene::Scene scene, SessionOptions options,
                    std::shared_ptr<ModelCache> cache, Executor executor,
                    std::shared_ptr<Listener> listener)
    : id_(std::move(id)),
      options_(options),
      cache_(std::move(cache)),
      listener_(std::move(listener)),
      document_(validated(std::move(scene)), {options.undo_depth, options.max_constraints,
                                              options.undo_bytes, options.max_constraint_nodes}),
      task_(mutex_, executor, [this] { say_closed(); }),
      check_task_(mutex_, executor, [] {}),
      edited_at_(Clock::now()) {
  options_.solver.validate();
}

void Session::Impl::open() {
  std::unique_lock lock(mutex_);
  work_ = true;
  post(std::move(lock));
  lock = std::unique_lock(mutex_);
  if (state_ == State::kBuilding && !task_.is_pending() && !message_.empty()) {
    throw Error(ErrorCode::kInternal, "", message_);
  }
}

/// Sees to it that a task runs. Called with the lock, leaves without it.
void Session::Impl::post(std::unique_lock<std::mutex> lock) {
  interrupt_.store(true, std::memory_order_relaxed);
  stop_check();
  task_.post(
      std::move(lock), [self = shared_from_this()] { self->run(); }, message_);
}

void Session::Impl::demand_usable() const {
  if (task_.is_closed()) throw Error(ErrorCode::kFailedPrecondition, "", "the session is closed");
}

EditReceipt Session::Impl::edit(const std::vector<Edit>& edits, std::optional<Revision> expected) {
  const std::lock_guard one_at_a_time(edits_);
  const auto demand_editable = [this] {
    demand_usable();
    if (state_ != State::kFailed) return;
    throw Error(ErrorCode::kFailedPrecondition, "",
                fmt::format("the session has no model: {}", message_));
  };
  EditReceipt receipt;
  Touched touched;
  std::optional<Document> edited;
  if (document_.is_long(edits)) {
    read([&](const Impl&) { demand_editable(); });
    edited.emplace(document_);
    receipt = edited->apply(edits, expected, touched);
  }
  std::unique_lock lock(mutex_);
  demand_editable();
  if (edited) {
    document_.exchange_edited(*edited);
    touched_.add(touched);
  } else {
    receipt = document_.apply(edits, expected, touched_);
  }
  edited_at_ = Clock::now();
  work_ = true;
  skip_solve_ = false;
  post(std::move(lock));
  return receipt;
}

void Session::Impl::solve_cold(std::uint64_t request) {
  std::unique_lock lock(mutex_);
  demand_usable();
  if (state_ == State::kFailed) {  // a second try at the model
    state_ = State::kBuilding;
    message_.clear();
    progress_ = {};
    cancellation_ = {};
  }
  work_ = cold_ = true;
  cold_asked_ = request;
  skip_solve_ = false;
  post(std::move(lock));
}

void Session::Impl::cancel() {
  const std::lock_guard lock(mutex_);
  if (!task_.is_pending()) return;
  cancellation_.request();
  skip_solve_ = true;
  cold_ = false;
}

void Session::Impl::shut(Farewell farewell) {
  std::unique_lock lock(mutex_);
  state_ = State::kClosed;
  cancellation_.request();
  interrupt_.store(true, std::memory_order_relaxed);
  stop_check();
  // A listener must not block: the check's task ends by itself and calls no listener.
  const auto wait = task_.is_current() ? SerialTask::Wait::kNone : SerialTask::Wait::kUntilIdle;
  task_.close(std::move(lock), farewell);
  check_task_.close(std::unique_lock(mutex_), Farewell::kSilent, wait);
}

void Session::Impl::say_closed() {
  tell(listener_.get(), [](Listener& listener) { listener.on_state(State::kClosed, ""); });
}

scene::Scene Session::Impl::scene() const {
  std::shared_ptr<const scene::Scene> unedited;
  std::vector<scene::Constraint> constraints;
  std::vector<scene::Keyframe> keyframes;
  scene::End first_end, last_end;
  scene::Dynamics dynamics;
  scene::MaterialVariables variables;
  {
    const std::lock_guard lock(mutex_);
    unedited = document_.unedited();
    constraints = document_.constraint_list();
    keyframes = document_.keyframe_list();
    first_end = document_.first_end();
    last_end = document_.last_end();
    dynamics = document_.dynamics();
    variables = document_.material().variables;
  }
  scene::Scene scene = *unedited;
  scene.constraints = std::move(constraints);
  scene.keyframes = std::move(keyframes);
  scene.first_end = first_end;
  scene.last_end = last_end;
  scene.dynamics = dynamics;
  // What the session mixes: opened anew with other variables, the scene would take another number.
  if (scene.model.candidate_modes == 0 && variables != scene.material_optimisation.variables)
    scene.model.candidate_modes = scene::wanted_candidate_modes(*unedited);
  scene.material_optimisation.variables = variables;
  // At a lower frame rate than it was opened with, as a fit takes it.
  if (auto& frequency = scene.material_optimisation.max_frequency_hz)
    frequency = std::min(*frequency, 0.5 * dynamics.frames_per_second);
  return scene;
}

Eigen::MatrixXd Session::Impl::positions(const Result& result, int first_frame,
                                         int frame_count) const {
  const auto built = read([](const Impl& impl) { return impl.built_; });
  if (!built) throw Error(ErrorCode::kFailedPrecondition, "", "the model is not built yet");
  const Eigen::MatrixXf& q = result.coordinates;
  if (q.rows() != built->model->basis_size()) {
    throw Error(ErrorCode::kInvalidArgument, "result", "the result belongs to another model");
  }
  if (first_frame < 0 || first_frame >= q.cols()) {
    throw Error(ErrorCode::kOutOfRange, "first_frame",
                fmt::format("frame {} is outside 0 .. {}", first_frame, q.cols() - 1));
  }
  if (frame_count < 0 || frame_count > q.cols() - first_frame) {
    throw Error(ErrorCode::kOutOfRange, "frame_count",
                fmt::format("{} frames from frame {} on, there are {}", frame_count, first_frame,
                            q.cols() - first_frame));
  }
  const LengthUnit unit(document_.unedited()->length_unit_in_metres);
  return positions_of(built->geometry, unit, built->compact_of_source, *built->model,
                      q.middleCols(first_frame, frame_count));
}

}  // namespace limber::session
