#include "engine/session/bodies/mode_chooser.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/session/bodies/session.h"

namespace limber::session {
namespace {

using Eigen::Index;

int elastic_modes(const reduced::ReducedModel& model) {
  return model.coordinate_count() - model.rigid_count;
}

/// The most that map_model() asks of this body.
int modes_of_mesh(const bodies::ElasticBody& body) {
  const int free_nodes = body.mesh.node_count() - static_cast<int>(body.fixed_nodes.size());
  return 3 * free_nodes - (body.is_free() ? 6 : 0) - 1;
}

std::string share_text(double share) { return fmt::format("{:.2g} %", 100 * share); }

/// z with other modes, whose first ones are the same.
Eigen::MatrixXd resized(const Eigen::MatrixXd& motion, Index rows) {
  Eigen::MatrixXd other = Eigen::MatrixXd::Zero(rows, motion.cols());
  const Index common = std::min(rows, motion.rows());
  other.topRows(common) = motion.topRows(common);
  return other;
}

/// Energies are sums of squared forces. If a motion needs none, such as a rigid one of a free body,
/// rounding leaves about this share of its own square, and more modes another share.
bool is_rounding(double energy, const Eigen::MatrixXd& motion) {
  constexpr double kRounding = 1e-20;
  return energy <= kRounding * motion.squaredNorm();
}

}  // namespace

Eigen::MatrixXd mode_transfer(const reduced::ReducedModel& from, const reduced::ReducedModel& to) {
  LIMBER_DEMAND(from.rigid_count == to.rigid_count && from.node_count == to.node_count);
  const Index rigid = from.rigid_count;
  const Index had = from.coordinate_count() - rigid, has = to.coordinate_count() - rigid;
  Eigen::MatrixXd transfer = Eigen::MatrixXd::Zero(rigid + has, rigid + had);
  transfer.topLeftCorner(rigid, rigid).setIdentity();
  // Columns of one size: those of high modes are smaller by far.
  const Eigen::VectorXd size = to.modes.rightCols(has).colwise().norm().transpose();
  const Eigen::MatrixXd columns = to.modes.rightCols(has) * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd gram = columns.transpose() * columns;
  const Eigen::MatrixXd sides = columns.transpose() * from.modes.rightCols(had);
  transfer.bottomRightCorner(has, had) =
      size.cwiseInverse().asDiagonal() * gram.colPivHouseholderQr().solve(sides);
  return transfer;
}

std::string reason_against_more_modes(const spacetime::SolveReport& before,
                                      const spacetime::SolveReport& with_more) {
  if (with_more.status != spacetime::SolveStatus::kConverged)
    return fmt::format("the solve with them has not converged{}{}",
                       with_more.message.empty() ? "" : ": ", with_more.message);
  if (with_more.total_energy <= before.total_energy) return "";
  return fmt::format("the solve with them ended at a higher energy, {:.6g} instead of {:.6g}",
                     with_more.total_energy, before.total_energy);
}

/// With r modes, the first ones of a model.
struct ModeChooser::Optimum {
  SharedModel model;
  int modes = 0;
  Eigen::MatrixXd motion;
  double energy = 0;
  Eigen::MatrixXd transfer;  // from the request's coordinates
};

ModeChooser::ModeChooser(std::shared_ptr<const scene::Scene> scene, ModeChoiceOptions options,
                         spacetime::SolverOptions solver, std::shared_ptr<const ModelCache> cache)
    : scene_(std::move(scene)), options_(options), solver_(solver), cache_(std::move(cache)) {
  options_.validate();
}

ModeFinding ModeChooser::choose(const ModeRequest& request, const JobContext& job) {
  const BodyResult& result = *request.result;
  Optimum now{request.model, request.modes, result.modal, result.report.total_energy, {}};
  now.transfer.setIdentity(result.modal.rows(), result.modal.rows());
  ModeFinding finding;
  finding.choice.energies = {{request.modes, now.energy}};
  if (is_rounding(now.energy, now.motion)) {
    finding.choice.state = ModeChoice::State::kSettled;
    finding.choice.reason = "the motion takes no forces but those of rounding";
  } else {
    grow(request, now, finding.choice, job);
  }
  if (now.modes == request.modes && finding.choice.state == ModeChoice::State::kSettled &&
      finding.choice.energies.size() > 1)
    shrink(request, now, finding.choice, job);
  std::sort(finding.choice.energies.begin(), finding.choice.energies.end(),
            [](const ModeEnergy& a, const ModeEnergy& b) { return a.modes < b.modes; });
  finding.choice.modes = now.modes;
  finding.motion = std::move(now.motion);
  finding.transfer = std::move(now.transfer);
  finding.model = std::move(now.model);
  // Modes alone, as the question takes them, are no model yet.
  if (finding.model != request.model) build(request, finding, job);
  return finding;
}

ModeChooser::SharedModel ModeChooser::modes_alone(const ModeRequest& request, int modes,
                                                  const JobContext& job) const {
  const bodies::ElasticBody& body = request.body->mapped.body;
  bodies::ModalOptions options;
  options.mode_count = modes;
  const reduced::ScaledModes scaled = reduced::scale_modes(
      body, bodies::modal_analysis(body, options, JobContext{job.cancellation, {}}));
  auto model = std::make_shared<reduced::ReducedModel>();
  model->node_count = body.mesh.node_count();
  model->length = body.length();
  model->rigid_count = scaled.rigid_count;
  model->mechanism_count = scaled.mechanism_count;
  model->eigenvalues = scaled.eigenvalues;
  model->modes = scaled.modes;
  return model;
}

ModeChooser::Optimum ModeChooser::optimum(const ModeRequest& request, const SharedModel& model,
                                          int modes, const Eigen::MatrixXd& start,
                                          const JobContext& job) const {
  const BodyParts& body = *request.body;
  const ModeProblem& problem = request.problem;
  const auto kinematics = std::make_shared<reduced::FullKinematics>(body.mapped.body, model,
                                                                    body.reconstruction, body.base);
  const spacetime::Material material = map_material(problem.dynamics, modes, *model);
  spacetime::Solver solver(kinematics, material.dynamics, problem.timeline, solver_,
                           material.mixing);
  if (problem.load.size() > 0) {
    const reduced::BaseLoad load = reduced::base_load(body.mapped.body, model->modes,
                                                      model->rigid_count + model->mechanism_count,
                                                      body.base, {job.cancellation, {}});
    solver.set_load(problem.dynamics.inertia * load.of_modes(material.mixing));
  }
  for (const auto& [constraint, site] : problem.constraints) {
    spacetime::PositionConstraint own = constraint;
    own.site = kinematics->add_site(*site);
    solver.add(own);
  }
  solver.set_weight_scale(problem.weight_scale);
  solver.warm_start(resized(start, material.modes()), spacetime::Known::kAnswer);
  const spacetime::SolveReport report =
      solver.solve({job.cancellation, {}},
                   [&](const auto& /*improved*/) { return !job.cancellation.requested(); });
  job.throw_if_cancelled();
  if (report.status != spacetime::SolveStatus::kConverged || !std::isfinite(report.total_energy)) {
    throw Error(ErrorCode::kNumerical, "",
                fmt::format("the optimum with {} modes was not found: {}", modes,
                            report.message.empty() ? "no reason is known" : report.message));
  }
  return {model, modes, solver.motion(), report.total_energy, {}};
}

void ModeChooser::grow(const ModeRequest& request, Optimum& now, ModeChoice& choice,
                       const JobContext& job) const {
  const double tolerance = scene_->model.tolerance;
  const int mesh = modes_of_mesh(request.body->mapped.body);
  const int most = std::min(options_.most, mesh);
  for (;;) {
    const int next = std::min(most, static_cast<int>(std::ceil(options_.growth * now.modes)));
    if (next <= now.modes) {
      choice.state = ModeChoice::State::kBounded;
      choice.reason = now.modes >= mesh ? "all that the mesh has" : "the most that are chosen";
      if (choice.saving) {
        choice.reason += fmt::format(
            "; the optimal energy has not settled to the scene's {}: the last {} modes lowered it "
            "by {}",
            share_text(tolerance), now.modes - choice.energies[choice.energies.size() - 2].modes,
            share_text(*choice.saving));
      }
      return;
    }
    const bool has_modes = elastic_modes(*now.model) >= next;
    const SharedModel model = has_modes ? now.model : modes_alone(request, next, job);
    const Eigen::MatrixXd transfer =
        has_modes ? Eigen::MatrixXd() : mode_transfer(*now.model, *model);
    const Eigen::MatrixXd start =
        has_modes ? now.motion : Eigen::MatrixXd(transfer.leftCols(now.motion.rows()) * now.motion);
    Optimum larger = optimum(request, model, next, start, job);
    choice.energies.push_back({next, larger.energy});
    choice.saving = energy_saving(now.energy, larger.energy);
    if (std::abs(*choice.saving) <= tolerance) {
      choice.state = ModeChoice::State::kSettled;
      choice.reason =
          fmt::format("with {} modes the optimal energy is {} lower, within the scene's {}", next,
                      share_text(std::max(0.0, *choice.saving)), share_text(tolerance));
      return;
    }
    if (*choice.saving < 0) {  // more modes cannot raise the optimum of the same minimum
      choice.state = ModeChoice::State::kBounded;
      choice.reason = fmt::format(
          "with {} modes another optimum was found, of a higher energy: {:.6g} instead of {:.6g}",
          next, larger.energy, now.energy);
      choice.saving.reset();
      return;
    }
    larger.transfer = has_modes
                          ? resized(now.transfer, larger.motion.rows())
                          : Eigen::MatrixXd((transfer.leftCols(now.motion.rows()) * now.transfer)
                                                .topRows(larger.motion.rows()));
    now = std::move(larger);
  }
}

void ModeChooser::shrink(const ModeRequest& request, Optimum& now, ModeChoice& choice,
                         const JobContext& job) const {
  const double most = options_.shrink_share * scene_->model.tolerance;
  const double energy = now.energy;
  Optimum last = now;
  for (;;) {
    const int next = static_cast<int>(std::floor(last.modes / options_.growth));
    if (next < 1) return;
    Optimum smaller = optimum(request, last.model, next, last.motion, job);
    choice.energies.push_back({next, smaller.energy});
    if (std::abs(energy_saving(smaller.energy, energy)) > most) return;
    choice.fewer = next;
    smaller.transfer = last.transfer.topRows(smaller.motion.rows());
    last = smaller;
    if (next < options_.least) continue;  // reports that they would suffice, without using them
    choice.reason = fmt::format("{} modes did not change the optimal energy by more than {}",
                                request.modes, share_text(most));
    now = std::move(smaller);
  }
}

void ModeChooser::build(const ModeRequest& request, ModeFinding& finding,
                        const JobContext& job) const {
  const auto begin = std::chrono::steady_clock::now();
  const MappedBody& mapped = request.body->mapped;
  const JobContext quiet{job.cancellation, {}};
  reduced::ModelOptions options = map_model(*scene_, mapped.body);
  options.mode_count = std::max(options.mode_count, finding.choice.modes);
  const Eigen::MatrixXd& animation = request.body->base;
  const auto make = [&](const JobContext& shared) {
    return std::make_shared<const reduced::ReducedModel>(
        reduced::build_model(mapped.body, options, shared, animation));
  };
  std::shared_ptr<const reduced::ReducedModel> model;
  if (cache_) {
    const auto found = cache_->find_or_build(ModelCache::key(mapped.body, options, animation),
                                             mapped.body.mesh.node_count(), quiet, make);
    model = found.model;
    finding.from_cache = found.is_from_disk;
  } else {
    model = make(quiet);
  }
  if (animation.size() > 0) {
    finding.base = std::make_shared<const reduced::BaseMotion>(
        reduced::base_motion(mapped.body, *model, animation, quiet));
  }
  const Index rows = finding.motion.rows();
  const Eigen::MatrixXd transfer = mode_transfer(*finding.model, *model);
  const Eigen::MatrixXd first = transfer.topLeftCorner(std::min(rows, transfer.rows()), rows);
  finding.motion = first * finding.motion;
  finding.transfer = first * finding.transfer;
  finding.model = std::move(model);
  finding.build_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace limber::session
