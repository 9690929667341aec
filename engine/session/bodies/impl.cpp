#include "engine/session/bodies/impl.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "engine/scene/pinned_motion.h"
#include "engine/session/bodies/geometry.h"

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

BodySession::Impl::Impl(std::string id, scene::Scene scene, SessionOptions options,
                        std::shared_ptr<ModelCache> cache, Executor executor,
                        std::shared_ptr<BodyListener> listener)
    : SessionCore(std::move(id), executor, std::move(listener)),
      options_(options),
      cache_(std::move(cache)),
      document_(validated(std::move(scene)), {options.undo_depth, options.max_constraints,
                                              options.undo_bytes, options.max_constraint_nodes}),
      check_(
          mutex_, executor,
          [this](const CheckRequest& request, const JobContext& job) {
            return check(request, job);
          },
          [this] { post(std::unique_lock(mutex_)); }),
      choice_(
          mutex_, executor,
          [this](const ModeRequest& request, const JobContext& job) {
            if (!chooser_) {
              chooser_ = std::make_unique<ModeChooser>(document_.unedited(), *options_.mode_choice,
                                                       options_.solver, cache_);
            }
            return chooser_->choose(request, job);
          },
          [this] { post(std::unique_lock(mutex_)); }, Urgency::kLong),
      search_(
          mutex_, std::move(executor),
          [this](const StartRequest& request, const JobContext& job) {
            return search_starts(request, options_.solver, job);
          },
          [this] { post(std::unique_lock(mutex_)); }, Urgency::kIdle) {
  scene_ = document_.unedited();
  options_.solver.validate();
  if (options_.mode_choice) options_.mode_choice->validate();
  if (options_.start_search) options_.start_search->validate();
}

EditReceipt BodySession::Impl::edit(const std::vector<BodyEdit>& edits,
                                    std::optional<Revision> expected, const Author& author) {
  EditReceipt receipt;
  Touched touched;
  std::optional<Document> edited;
  return change(
      [&] {
        document_.prepare(edits);
        if (!document_.is_long(edits)) return;
        edited.emplace(document_);
        receipt = edited->apply(edits, expected, touched, author);
      },
      [&] {
        if (!edited) return document_.apply(edits, expected, touched_, author);
        document_.exchange_edited(*edited);
        touched_.add(touched);
        return std::move(receipt);
      });
}

void BodySession::Impl::begin_at(const Document::Checkpoint& checkpoint) {
  change(
      [&] {
        demand_unedited();
        document_.demand_reachable(checkpoint);
      },
      [&] {
        document_.begin_at(checkpoint);
        whole_ = true;
        return EditReceipt{document_.revision(), {}, {}, {}};
      });
}

void BodySession::Impl::demand_reachable(const Document::Checkpoint& checkpoint) {
  const Document copy = [this] {
    const std::lock_guard one_at_a_time(edits_);
    return document_;
  }();
  copy.demand_reachable(checkpoint);
}

void BodySession::Impl::solve_cold(std::uint64_t request) {
  std::unique_lock lock(mutex_);
  demand_open();
  if (state_ == State::kFailed) build_again();
  cold_ = true;
  cold_requested_ = request;
  request_round(std::move(lock));
}

void BodySession::Impl::interrupt_round() {
  out_of_date_.request();
  gone_out_of_date_.notify_all();
  check_.stop();
  choice_.stop();
  search_.stop();
  is_choosing_ = is_choice_cancelled_ = is_searching_ = is_search_cancelled_ = false;
}

void BodySession::Impl::cancel() {
  {
    std::unique_lock lock(mutex_);
    // Due work is out of date if a newer round is pending or runs.
    const bool is_idle = !has_work_ && !is_solving_;
    if (is_searching_ || (is_search_due() && is_idle)) {
      search_.stop();
      is_searching_ = false;
      is_search_cancelled_ = true;
      is_choice_cancelled_ = newest_->awaits_modes;
    } else if (is_choosing_ || (is_choice_due() && is_idle)) {
      choice_.stop();
      is_choosing_ = false;
      is_choice_cancelled_ = true;
    }
    if (is_search_cancelled_ || is_choice_cancelled_) post(std::move(lock));
  }
  SessionCore::cancel();
}

BodyOrder BodySession::Impl::take_order() {
  BodyOrder order;
  out_of_date_ = {};
  is_solving_ = true;
  order.content = document_.content();
  order.is_with_fewer_modes = fewer_modes_ > 0;
  order.is_with_other_pins = touched_.pins;
  order.is_whole = whole_;
  order.batch = whole_ || order.is_with_fewer_modes || order.is_with_other_pins
                    ? whole_batch(document_)
                    : batch_of(document_, touched_);
  order.start = cold_ ? BodyOrder::Start::kCold : BodyOrder::Start::kWarm;
  if (cold_) cold_taken_ = cold_requested_;
  order.cold_request = cold_taken_;
  touched_ = {};
  whole_ = cold_ = false;
  return order;
}

/// They call no listener, and end by themselves.
void BodySession::Impl::close_other_tasks(SerialTask::Wait wait) {
  check_.close(wait);
  choice_.close(wait);
  search_.close(wait);
}

scene::Scene BodySession::Impl::scene(BaseMotionPart base) const {
  std::shared_ptr<const scene::Scene> unedited;
  std::vector<scene::Constraint> constraints;
  std::vector<scene::Keyframe> keyframes;
  scene::End first_end, last_end;
  scene::Dynamics dynamics;
  scene::MaterialVariables variables;
  PinPaths pins;
  int modes = 0;
  std::shared_ptr<const Built> built;
  {
    const std::lock_guard lock(mutex_);
    modes = mode_choice_.modes;
    built = built_;
    unedited = document_.unedited();
    constraints = document_.constraint_list();
    keyframes = document_.keyframe_list();
    first_end = document_.first_end();
    last_end = document_.last_end();
    dynamics = document_.dynamics();
    variables = document_.material().variables;
    pins = document_.pins();
  }
  scene::Scene scene = *unedited;
  if (base == BaseMotionPart::kLeftOut) {
    scene.base_motion.resize(0, 0);
  } else {
    scene = scene::with_pins(std::move(scene), pins);
  }
  scene.constraints = std::move(constraints);
  scene.keyframes = std::move(keyframes);
  scene.first_end = first_end;
  scene.last_end = last_end;
  scene.dynamics = dynamics;
  // A fit is of the modes that the session has; opened anew, it would not choose them.
  if (built && variables != scene::MaterialVariables::kMotion && modes > scene.model.mode_count) {
    scene.model.mode_count = modes;
    scene.model.candidate_modes = built->model->coordinate_count() - built->model->rigid_count;
  }
  // The number of mixed modes: opened with other variables, the scene would take another one.
  if (scene.model.candidate_modes == 0 && variables != scene.material_optimisation.variables)
    scene.model.candidate_modes = scene::candidate_mode_count(*unedited);
  scene.material_optimisation.variables = variables;
  // At a lower frame rate than it was opened with, as a fit takes it.
  if (auto& frequency = scene.material_optimisation.max_frequency_hz)
    frequency = std::min(*frequency, 0.5 * dynamics.frames_per_second);
  return scene;
}

Eigen::MatrixXd BodySession::Impl::positions(const BodyResult& result, int first_frame,
                                             int frame_count) const {
  const auto compact_of_source = read([this] { return compact_of_source_; });
  if (!compact_of_source)
    throw Error(ErrorCode::kFailedPrecondition, "", "the model is not built yet");
  const Eigen::MatrixXf& q = result.coordinates;
  if (!result.shown || q.rows() != result.shown->basis->cols()) {
    throw Error(ErrorCode::kInvalidArgument, "result", "the result has no basis of its size");
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
  return positions_of(*result.shown->geometry, unit, *compact_of_source, *result.shown->basis,
                      q.middleCols(first_frame, frame_count));
}

}  // namespace limber::session
