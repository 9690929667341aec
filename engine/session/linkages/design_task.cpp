#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/base/lent_place.h"
#include "engine/session/linkages/design_reach.h"
#include "engine/session/linkages/impl.h"

namespace limber::session {
namespace {

DesignEnd end_of(rods::DesignStatus status) {
  switch (status) {
    case rods::DesignStatus::kConverged:
      return DesignEnd::kConverged;
    case rods::DesignStatus::kSettled:
      return DesignEnd::kSettled;
    case rods::DesignStatus::kInfeasible:
      return DesignEnd::kInfeasible;
    case rods::DesignStatus::kStuck:
      return DesignEnd::kStuck;
    case rods::DesignStatus::kIterationLimit:
      return DesignEnd::kIterationLimit;
    case rods::DesignStatus::kCancelled:
      break;
  }
  return DesignEnd::kStopped;
}

bool is_optimum(const DesignInfo& info) {
  return info.end == DesignEnd::kConverged || info.end == DesignEnd::kSettled;
}

/// Designs that are worth having without being asked about.
bool is_taken_at_once(const DesignInfo& info) {
  return (is_optimum(info) || info.end == DesignEnd::kIterationLimit) && info.best.holds;
}

/// Also stops a design that would have ended by itself in the next moment.
void be_stopped(DesignInfo& info) {
  if (info.end == DesignEnd::kStopped) return;
  info.end = DesignEnd::kStopped;
  info.message = "cancelled";
  info.other_optima.clear();
}

void note_terms(const LiveDesign& design, DesignInfo& info) {
  info.start = design.start();
  info.now = design.now();
  info.best = design.best();
  info.best_iteration = design.best_iteration();
  info.flat_height_allowed = design.flat_height_allowed();
  info.smallest_angle_allowed = design.smallest_angle_allowed();
  info.flat_angle = design.flat_angle();
}

DesignStart start_of(const LinkageResult& result) {
  const rods::LinkageModel& model = result.statics->model();
  return {model.segment_lengths(), model.edge_lengths(), model.section_scales(),
          result.statics->by_edges()};
}

/// Edits that apply a candidate's sizes, as one step of undo.
std::vector<LinkageEdit> edits_of(const DesignCandidate& candidate,
                                  const std::shared_ptr<const scene::LinkageErection>& erection) {
  std::vector<LinkageEdit> edits;
  const RodSizes& sizes = candidate.sizes;
  switch (candidate.variables.lengths) {
    case rods::LengthVariables::kSegments:
      edits.emplace_back(SetSegmentLengths{sizes.segments});
      break;
    case rods::LengthVariables::kEdges:
      edits.emplace_back(SetEdgeLengths{sizes.edges});
      break;
    case rods::LengthVariables::kKept:
      break;
  }
  if (candidate.variables.sections == rods::SectionVariables::kSegments)
    edits.emplace_back(SetSectionScales{sizes.sections});
  edits.emplace_back(SetErection{erection});
  return edits;
}

bool has_sizes(const scene::LinkageConditions& conditions, const DesignCandidate& candidate) {
  const auto same = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return a.size() == b.size() && a == b;
  };
  const RodSizes& sizes = candidate.sizes;
  switch (candidate.variables.lengths) {
    case rods::LengthVariables::kSegments:
      if (!same(conditions.segment_lengths, sizes.segments)) return false;
      break;
    case rods::LengthVariables::kEdges:
      if (!same(conditions.edge_lengths, sizes.edges)) return false;
      break;
    case rods::LengthVariables::kKept:
      break;
  }
  return candidate.variables.sections == rods::SectionVariables::kKept ||
         same(conditions.section_scales, sizes.sections);
}

void append_sentence(std::string& message, const std::string& part) {
  if (part.empty()) return;
  if (!message.empty()) message += "; ";
  message += part;
}

/// Conditions under which derivatives are not known.
void demand_unloaded(const scene::LinkageConditions& conditions) {
  const auto refuse = [](const char* field, const char* message) {
    throw Error(ErrorCode::kFailedPrecondition, field, message);
  };
  if (!conditions.targets.empty())
    refuse("targets", "a linkage is designed without springs to targets: remove them first");
  if (!conditions.loads.empty())
    refuse("loads", "a linkage is designed without loads: take them away first");
  if (!conditions.gravity.isZero(0))
    refuse("gravity", "a linkage is designed without weight: set gravity to 0 first");
}

}  // namespace

void LinkageSession::Impl::start_design(DesignRequest request, std::uint64_t tag) {
  const auto [shape, newest] = read([this] {
    demand_model();
    return std::pair{final_ ? final_->shape : nullptr, final_};
  });
  if (!newest) {
    throw Error(ErrorCode::kFailedPrecondition, "",
                "the linkage has no shape yet that a design could begin from: wait for its first "
                "result");
  }
  const Eigen::Matrix3Xd joints = shape->joints(newest->frames->rightCols<1>());
  if (joints.cols() < 2) {
    throw Error(
        ErrorCode::kFailedPrecondition, "",
        fmt::format("the linkage has {}, so that it cannot deploy: designs take two at least",
                    joints.cols() == 0 ? "no joints" : "one joint"));
  }
  request.validate(static_cast<int>(joints.cols()), start_of(*newest));
  if (request.fitted_points.cols() > 0) {
    request.goal.placement = rods::fitted(request.goal.placement, request.fitted_points, joints);
  }
  try {
    demand_near(request.goal, joints);
  } catch (const Error& error) {
    throw Error(error.code(), "goal." + error.field(), error.what());
  }
  std::unique_lock lock(mutex_);
  demand_model();
  demand_unloaded(*document_.conditions());
  design_.begin(std::move(request), tag);
  check_.stop();
  post(std::move(lock));
}

void LinkageSession::Impl::change_design(const DesignChange& change) {
  const std::lock_guard lock(mutex_);
  Eigen::Matrix3Xd joints(3, 0);
  if (newest_) joints = newest_->shape->joints(newest_->frames->rightCols<1>());
  design_.change(change, joints);
}

/// Called with the lock. From now on, readers get the shape that the session returns to.
void LinkageSession::Impl::stop_design() {
  design_.stop_any();
  if (design_.is_running() && !design_.info()->taken) newest_ = final_;
}

/// Called with the lock.
EditReceipt LinkageSession::Impl::apply_design(std::optional<Revision> expected) {
  const auto candidate = design_.best();
  if (!candidate)
    throw Error(ErrorCode::kFailedPrecondition, "", "there is no design to take: start one first");
  check_.stop();
  const Conditions before = document_.conditions();
  const std::optional<Revision> taken = design_.info()->taken;
  if (taken && (!expected || *expected == document_.revision()) && has_sizes(*before, *candidate)) {
    EditReceipt receipt;  // it is there: nothing to undo twice
    receipt.revision = *taken;
    return receipt;
  }
  EditReceipt receipt =
      document_.apply(edits_of(*candidate, erection_of(*design_.info())), expected);
  if (before == designed_) designed_equilibria_.push_back({document_.conditions(), candidate});
  design_.note_taken(receipt.revision);
  mark_changed();
  return receipt;
}

EditReceipt LinkageSession::Impl::take_design(std::optional<Revision> expected) {
  const std::lock_guard one_at_a_time(edits_);
  std::unique_lock lock(mutex_);
  demand_model();
  const Revision before = document_.revision();
  EditReceipt receipt = apply_design(expected);
  design_.stop_any();
  if (document_.revision() == before) return receipt;
  note_change(std::move(lock));
  return receipt;
}

/// The design's shape, where there is one, and the remarks on it.
void LinkageSession::Impl::publish_design(const LiveDesign* design, const DesignInfo& info,
                                          const DesignRound& round) {
  auto described = std::make_shared<DesignInfo>(info);
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed()) return;
    if (design_.info()) described->taken = design_.info()->taken;
    design_.note(described, design != nullptr ? design->candidate() : nullptr);
  }
  notify(design_listener_.get(), [&](LinkageListener& listener) { listener.on_design(described); });
  if (design == nullptr) return;
  auto result = std::make_shared<LinkageResult>();
  result->design = std::move(described);
  result->frames = std::make_shared<const Eigen::MatrixXd>(design->shapes());
  result->mean_angle = design->mean_angle();
  result->section_scales = design->section_scales();
  result->revision = round.revision;
  name_edges(*result);
  publish_if(std::move(result), [this] { return !design_.is_stopping(); });
}

/// Publishes its progress, waits while it is paused, and passes new requests of clients to the
/// design. @returns whether the goal has changed
bool LinkageSession::Impl::between_steps(LiveDesign& design, DesignInfo& info,
                                         const DesignRound& round) {
  bool changed = false;
  const auto publish_now = [&] {
    note_terms(design, info);
    publish_design(&design, info, round);
  };
  const auto go_to = [&](DesignGoal goal) {
    design.set_goal(goal);
    info.goal = std::move(goal);
    changed = true;
  };
  publish_now();
  std::unique_lock lock(mutex_);
  std::optional<LentPlace> lent;
  while (design_.is_paused()) {
    if (info.state != DesignState::kPaused) {
      info.state = DesignState::kPaused;
      lock.unlock();
      publish_now();
      lock.lock();
    }
    if (!lent) lent.emplace();
    design_.wait(lock);
    if (!design_.is_paused()) break;
    if (auto goal = design_.take_goal()) {
      lock.unlock();
      go_to(std::move(*goal));
      publish_now();
      lock.lock();
    }
  }
  std::optional<DesignGoal> goal = design_.take_goal();
  lock.unlock();
  lent.reset();
  if (goal) go_to(std::move(*goal));
  note_terms(design, info);
  info.state = DesignState::kRunning;
  return changed;
}

void LinkageSession::Impl::search(const DesignRound& round, DesignInfo& info) {
  const JobContext job{round.order.stop, {}};
  if (live_->settled_under() != round.conditions) {
    throw Error(
        ErrorCode::kFailedPrecondition, "",
        "the linkage is not in equilibrium under its conditions: undo the edit that left it so, "
        "or request less");
  }
  LiveDesign design(*live_, round.order.request, ended_.energy_scale(*round.conditions), job);
  info.state = DesignState::kRunning;
  between_steps(design, info, round);
  design.run(
      job,
      [&](const LiveDesign::Step& step) {
        info.iteration = step.iteration;
        info.accepted = step.accepted;
        info.trials = step.trials;
        between_steps(design, info, round);
      },
      [&](const rods::DesignReport& report) { end_search(design, info, round, report); });
}

/// An accepted design includes the erection, so it is found first. A stop interrupts the search.
void LinkageSession::Impl::find_erection(const LiveDesign& design, const DesignRound& round,
                                         DesignInfo& info) {
  if (info.end == DesignEnd::kStopped) return;
  DesignInfo running = info;
  running.end = DesignEnd::kNone;
  running.message = "finding the erection";
  publish_design(&design, running, round);
  try {
    LiveDesign::FoundErection found = design.find_erection({round.order.stop, {}});
    info.erection = found.erection ? std::move(found.erection) : without_erection(found.message);
    append_sentence(info.message, found.message);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
  }
}

/// Ends the design, unless clients want it to continue to another goal by now: then that is set.
void LinkageSession::Impl::end_search(LiveDesign& design, DesignInfo& info,
                                      const DesignRound& round, const rods::DesignReport& report) {
  if (design.go_to_best()) {  // the last published shape is the one that can be taken
    note_terms(design, info);
    publish_design(&design, info, round);
  }
  DesignInfo last = info;
  last.end = end_of(report.status);
  const int lengths = design.varied_lengths();
  for (const int i : report.at_bound) {
    if (i < lengths) {
      last.at_bound.push_back(i);
    } else {
      last.sections_at_bound.push_back(i - lengths);
    }
  }
  last.message = report.message;
  const std::string released = design.release({round.order.stop, {}});
  append_sentence(last.message, released);
  if (is_optimum(last)) last.other_optima = ended_.others_than(design, last, *round.conditions);
  find_erection(design, round, last);
  while (!end_design(last))
    if (between_steps(design, info, round)) return;
  if (is_optimum(last)) ended_.note(design, last, round.conditions);
}

void LinkageSession::Impl::run_design(const DesignRound& round) {
  DesignInfo info = read([this] { return *design_.info(); });
  publish_design(nullptr, info, round);
  try {
    search(round, info);
  } catch (const Error& error) {
    const bool stopped = error.code() == ErrorCode::kCancelled;
    info.end = stopped ? DesignEnd::kStopped : DesignEnd::kFailed;
    info.fault = error.code();
    info.fault_field = error.field();
    info.message = error.what();
  } catch (const std::exception& error) {
    info.end = DesignEnd::kFailed;
    info.message = error.what();
  }
  if (read([this] { return design_.is_running(); })) end_design(info);
}

/// The shape from before, to go back to.
std::shared_ptr<LinkageResult> LinkageSession::Impl::shape_from_before() const {
  auto result = std::make_shared<LinkageResult>(*read([this] { return final_; }));
  result->path.clear();
  result->frames = std::make_shared<const Eigen::MatrixXd>(result->frames->rightCols<1>());
  result->strains = std::make_shared<const Eigen::MatrixXf>(result->strains->rightCols<1>());
  return result;
}

/// Under the same lock, edits are allowed again, and either the taken design enters the document or
/// the session gets its shape back. A stop that was requested earlier is obeyed.
/// @param info  as it would end; gets the end it has come to
/// @returns false, and the design continues, where it would end by itself and clients wanted a
/// pause or another goal before
bool LinkageSession::Impl::end_design(DesignInfo& info) {
  std::shared_ptr<const DesignInfo> ended;
  auto before = shape_from_before();
  std::shared_ptr<const LinkageResult> older, older_final;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed()) return true;
    if (info.end != DesignEnd::kFailed) {
      if (design_.is_steered()) return false;
      if (design_.is_stopping()) be_stopped(info);
    }
    const bool was_taken = design_.info()->taken.has_value();
    if (!was_taken && is_taken_at_once(info)) {
      auto known = std::make_shared<DesignInfo>(*design_.info());
      known->erection = info.erection;
      design_.note(std::move(known), design_.best());
      try {
        (void)apply_design({});
      } catch (const Error& error) {  // e.g. a length beyond what a document allows
        info.message = error.what();
      }
    }
    if (info.end == DesignEnd::kStopped && design_.best() && !info.erection) {
      info.erection = erection_of(info);
      append_sentence(info.message, info.erection->failure);
    }
    design_.end(info);
    ended = design_.info();
    if (ended->taken) {
      before.reset();
      has_work_ = true;
    } else {
      set_newest(before, older, older_final);
    }
  }
  notify(design_listener_.get(), [&](LinkageListener& listener) {
    if (before) listener.on_result(before);
  });
  notify(design_listener_.get(), [&](LinkageListener& listener) { listener.on_design(ended); });
  return true;
}

}  // namespace limber::session
