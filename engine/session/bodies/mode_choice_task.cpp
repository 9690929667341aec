#include <fmt/format.h>

#include <limits>
#include <tuple>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/session/bodies/impl.h"
#include "engine/session/bodies/weight_scale.h"

// The choice of r, where the scene does not name it. Behind a final exact result that was checked,
// a task of its own compares optimal energies (ModeChooser); the session's task changes the modes,
// so that results keep their order. A newer edit interrupts both.
//
// More modes come with a better final result of the same revision. A smaller number takes effect
// from the next round on: the shown result stays.

namespace limber::session {
namespace {

constexpr double kUnpublished = -std::numeric_limits<double>::infinity();
constexpr const char* kCancelled = "the comparison was cancelled";

}  // namespace

/// With the lock, while building.
void BodySession::Impl::note_modes() {
  mode_choice_ = {};
  mode_choice_.modes = modes_;
  if (!options_.mode_choice) return;
  mode_choice_.state = document_.unedited()->model.names_modes() ? ModeChoice::State::kNamed
                                                                 : ModeChoice::State::kUnasked;
  if (mode_choice_.state == ModeChoice::State::kUnasked)
    mode_choice_.reason = "the question follows the first exact result";
}

std::string BodySession::Impl::reason_against_question(const BodyResult& result) {
  const scene::Scene& scene = *document_.unedited();
  const ModeChoiceOptions& options = *options_.mode_choice;
  const int tets = static_cast<int>(scene.mesh.tet_count());
  if (!result.is_exact || result.report.status != spacetime::SolveStatus::kConverged)
    return "energies are compared of exact results that have converged";
  if (problem_->variables() != scene::MaterialVariables::kMotion || problem_->has_fitted())
    return "the material is fitted, or was: another one would be fitted to other modes, and their "
           "energies do not compare";
  if (problem_->has_keyframes())
    return "keyframes ask for as much of a pose as the modes have: with more of them the energy is "
           "of another problem";
  if (result.report.rank_deficient)
    return "exact constraints depend on or contradict each other: how far they are missed changes "
           "with the modes, and energies do not compare";
  if (tets > options.most_tets)
    return fmt::format("{} tets, more than {}: comparing would take minutes", tets,
                       options.most_tets);
  if (scene.frame_count > options.most_frames)
    return fmt::format(
        "{} frames, more than {}: an edit could not interrupt the comparison at once",
        scene.frame_count, options.most_frames);
  const auto constraints = problem_->solver().constraints().size();
  if (constraints == 0) return "nothing is held";
  if (static_cast<double>(constraints) * tets > options.most_tet_readings)
    return fmt::format("{} constraints on {} tets: comparing would take minutes", constraints,
                       tets);
  return "";
}

bool BodySession::Impl::is_question(const BodyResult& result) {
  if (!options_.mode_choice || document_.unedited()->model.names_modes()) return false;
  std::string reason = reason_against_question(result);
  if (!reason.empty()) {
    const std::lock_guard lock(mutex_);
    if (mode_choice_.state == ModeChoice::State::kUnasked) mode_choice_.reason = std::move(reason);
    return false;
  }
  const ModeQuestion question =
      mode_question(problem_->mode_problem(dynamics_), result.report.total_energy);
  return !asked_ || !is_answered_by(question, *asked_, options_.mode_choice->energy_factor);
}

/// Called with the lock.
bool BodySession::Impl::is_choice_due() const {
  return newest_ && newest_ == final_ && newest_->awaits_modes && newest_->check == Check::kDone &&
         choice_.is_new(*newest_) && !is_choosing_ &&
         !(newest_->awaits_starts && (is_searching_ || search_.is_new(*newest_)));
}

bool BodySession::Impl::do_mode_work(std::unique_lock<std::mutex>& lock) {
  if (std::exchange(is_choice_cancelled_, false)) {
    const auto result = newest_;
    lock.unlock();
    question_ = mode_question(problem_->mode_problem(dynamics_), result->report.total_energy);
    note_unanswered(kCancelled);
    end_choice(result);
    return true;
  }
  if (const auto found = choice_.take()) {
    is_choosing_ = false;
    const bool is_newest = found->result == newest_;
    lock.unlock();
    if (is_newest) adopt(*found);
    return true;
  }
  if (!is_choice_due()) return false;
  begin_choice(lock);
  return true;
}

/// Takes the lock, may leave without it.
void BodySession::Impl::begin_choice(std::unique_lock<std::mutex>& lock) {
  const auto result = newest_;
  choice_.claim(*result);
  is_choosing_ = true;
  lock.unlock();
  ModeRequest request;
  try {
    request.problem = problem_->mode_problem(dynamics_);
    question_ = mode_question(request.problem, result->report.total_energy);
    provide_full();
    request.result = result;
    request.body = full_body_->parts();
    request.modes = modes_;
  } catch (const std::exception& error) {
    if (read([this] { return std::exchange(is_choosing_, false); }))  // else an edit was quicker
      adopt({result, {}, error.what()});
    return;
  }
  lock.lock();
  request.model = built_->model;
  choice_.begin(lock, result, std::move(request), shared_from_this());
}

void BodySession::Impl::adopt(const ModesFound& found) {
  if (!found.finding) {
    note_unanswered(fmt::format("the comparison failed: {}", found.failure));
    return end_choice(found.result);
  }
  const ModeFinding& finding = *found.finding;
  if (finding.choice.modes <= modes_) {
    asked_ = question_;
    read([&] {
      mode_choice_ = finding.choice;
      if (finding.choice.modes < modes_) fewer_modes_ = finding.choice.modes;
    });
    return end_choice(found.result);
  }
  Round round;
  EditBatch whole;
  {
    const std::lock_guard lock(mutex_);
    if (has_work_ || task_.is_closed()) return;  // an edit was quicker: its result is asked about
    round_ = Cancellation();
    round.revision = document_.revision();
    round.edited_at = edited_at_;
    round.order.content = document_.content();
    round.order.cold_request = cold_taken_;
    round.cancellation = round_;
    whole = whole_batch(document_);
  }
  std::string reason;
  try {
    WithModes other = with_more_modes(finding, whole);
    exchange_modes(other);
    try {
      reason = publish_with_more_modes(finding, *found.result, round);
    } catch (const std::exception& error) {
      reason = error.what();
    }
    if (newest_result() != found.result) return;
    exchange_modes(other);  // nothing was published: as before
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (reason.empty()) return;
  note_unanswered(fmt::format("{} modes were not taken: {}", finding.choice.modes, reason));
  end_choice(found.result);
}

/// Nothing of the session changes.
BodySession::Impl::WithModes BodySession::Impl::with_more_modes(const ModeFinding& finding,
                                                                const EditBatch& whole) {
  const scene::Scene& scene = *document_.unedited();
  const auto parts = full_body_->parts();
  WithModes more;
  more.modes = finding.choice.modes;
  more.problem = make_problem(*scene_, parts->mapped, finding.model, finding.base, more.modes);
  more.problem->start(whole);
  more.problem->solver().set_weight_scale(problem_->solver().weight_scale());
  more.problem->solver().warm_start(finding.motion, spacetime::Known::kAnswer);
  more.full_body = full_body_;
  more.problem_shown = problem_shown_;
  std::tie(more.built, more.shown) = read([this] { return std::pair{built_, shown_}; });
  more.transfers = transfers_;
  more.transfers.push_back(finding.transfer);
  more.tried = finding.motion;
  more.asked = question_;
  if (finding.model == more.built->model) return more;
  more.full_body = std::make_shared<FullBody>(parts, finding.model);
  more.problem_shown = make_shown(parts->mapped, finding.model);
  more.shown.push_back(more.problem_shown);
  if (more.shown.size() > kShownKept) more.shown.pop_front();
  auto built = std::make_shared<Built>(*more.built);
  built->model = built->trunk = finding.model;
  built->base = finding.base;
  built->message = finding.model->report.message;
  append_clause(built->message, model_notes(scene.model, *finding.model));
  built->accuracy = describe_accuracy(finding.model->report, scene.model.tolerance);
  built->seconds = finding.build_s;
  built->from_cache = finding.from_cache;
  more.built = std::move(built);
  return more;
}

void BodySession::Impl::exchange_modes(WithModes& other) {
  std::swap(modes_, other.modes);
  std::swap(problem_, other.problem);
  std::swap(full_body_, other.full_body);
  std::swap(problem_shown_, other.problem_shown);
  std::swap(transfers_, other.transfers);
  std::swap(tried_, other.tried);
  std::swap(asked_, other.asked);
  std::swap(from_rest_, other.from_rest);
  std::swap(is_exact_, other.is_exact);
  const std::lock_guard lock(mutex_);
  std::swap(built_, other.built);
  std::swap(shown_, other.shown);
}

std::string BodySession::Impl::publish_with_more_modes(const ModeFinding& finding,
                                                       const BodyResult& before,
                                                       const Round& round) {
  spacetime::SolveReport start;
  start.total_energy = 0;
  std::optional<spacetime::SolveReport> report = polish(round, start, kUnpublished);
  if (out_of_date_.requested()) return "";
  if (round.cancellation.requested()) return kCancelled;
  if (!report || !is_exact_) return "the solve with them has not ended";
  std::string reason = reason_against_more_modes(before.report, *report);
  if (!reason.empty()) return reason;
  add_sentence(report->message,
               fmt::format("{} modes in place of {}: the optimal energy was {:.6g} with those.",
                           modes_, before.modal.rows() - finding.model->rigid_count,
                           finding.choice.energies.front().energy));
  if (finding.choice.state == ModeChoice::State::kBounded)
    add_sentence(report->message, fmt::format("No more were taken: {}.", finding.choice.reason));
  report_missed_tolerance(*document_.unedited(), problem_->solver().weight_scale(), *report);
  asked_->energy = report->total_energy;
  const auto result = result_of_motion(round, *report, true);
  if (!result) return "";
  if (!result->is_exact) return kCancelled;
  solved_ = true;
  read([&] { mode_choice_ = finding.choice; });
  publish_of_round(result, round);
  answers_.keep(round.order.content, result);
  return "";
}

void BodySession::Impl::note_unanswered(std::string reason) {
  asked_ = question_;
  ModeChoice choice;
  choice.state = ModeChoice::State::kUnasked;
  choice.modes = modes_;
  choice.reason = std::move(reason);
  read([&] { mode_choice_ = std::move(choice); });
}

void BodySession::Impl::use_fewer_modes(const EditBatch& whole, bool is_warm) {
  const auto [fewer, built] = read([this] {
    return std::pair{std::exchange(fewer_modes_, 0), built_};
  });
  LIMBER_DEMAND(fewer > 0 && full_body_);
  const Eigen::Index rows = built->model->rigid_count + Eigen::Index{fewer};
  const auto shift = problem_->shift();
  transfers_.push_back(Eigen::MatrixXd::Identity(rows, problem_->solver().motion().rows()));
  modes_ = fewer;
  if (tried_.rows() > rows) tried_ = Eigen::MatrixXd(tried_.topRows(rows));
  renew_problem(
      make_problem(*scene_, full_body_->parts()->mapped, built->model, built->base, fewer), whole,
      is_warm ? shift : nullptr, is_warm);
}

/// Published once more, without the question.
void BodySession::Impl::end_choice(const std::shared_ptr<const BodyResult>& result) {
  auto again = std::make_shared<BodyResult>(*result);
  again->awaits_modes = false;
  publish(std::move(again));
}

Eigen::MatrixXd BodySession::Impl::in_present_modes(const BodyResult& result) const {
  Eigen::MatrixXd motion = result.modal;
  for (auto change = static_cast<std::size_t>(result.mode_changes); change < transfers_.size();
       ++change)
    motion = transfers_[change] * motion;
  return motion;
}

}  // namespace limber::session
