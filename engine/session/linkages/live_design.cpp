#include "engine/session/linkages/live_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/design/cell_area.h"
#include "engine/rods/design/erection.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/session/linkages/design_release.h"
#include "engine/session/linkages/size_path.h"

namespace limber::session {
namespace {

constexpr double kHeightRoom = 1.2;  // times the flat height at the start, if none is requested
constexpr double kLeastHeight = 1e-3;
// Share of the smallest angle of an open start, if none is requested: joints that turned over would
// fold the flat linkage through itself.
constexpr double kAngleShare = 0.1;
constexpr double kOpen = 0.02;  // [rad]
constexpr double kMaxIgnoredDistanceShare =
    1e-5;  // of the extent: largest distance that is not reported

/// A joint that both shapes are held at, so that they keep their place: one that is pinned, or the
/// middle one.
int anchor_of(const rods::Conditions& deployed, const rods::LinkageState& state) {
  for (const rods::JointPin& pin : deployed.pins)
    if (pin.hold != rods::Hold::kAngle) return pin.joint;
  const Eigen::Matrix3Xd joints = rods::joint_positions(state);
  Eigen::Index middle = 0;
  (joints.colwise() - joints.rowwise().mean()).colwise().norm().minCoeff(&middle);
  return static_cast<int>(middle);
}

void close_to(rods::LinkageEquilibrium& equilibrium, rods::LinkageState& state,
              const rods::Conditions& free, const rods::Conditions& held, const JobContext& job) {
  const rods::DeploymentReport deployment =
      rods::deploy(equilibrium, state, free, held, {}, JobContext{job.cancellation, {}});
  job.throw_if_cancelled();
  if (deployment.status == rods::DeploymentStatus::kReached) return;
  throw Error(ErrorCode::kFailedPrecondition, "flat_angle",
              fmt::format("the linkage does not go to a mean angle of {:.6g} degrees, at which it "
                          "is to be flat: {}",
                          *held.mean_opening_angle * kDegreesPerRadian, deployment.message));
}

rods::DesignPoint point_of(const DesignCandidate& candidate) {
  const RodSizes& sizes = candidate.sizes;
  return {sizes.segments, candidate.flat, candidate.deployed, sizes.edges, sizes.sections};
}

}  // namespace

LiveDesign::LiveDesign(const LiveLinkage& live, const DesignRequest& request, double energy_scale,
                       const JobContext& job)
    : shape_(live.shape()),
      length_unit_(live.length_unit()),
      goal_(request.goal),
      smallest_angle_(request.smallest_angle),
      requested_flat_angle_(request.flat_angle),
      least_cover_(request.least_cover) {
  rods::Conditions deployed = live.held(), flat;
  const int anchor = anchor_of(deployed, live.state());
  flat.pins = {{anchor, rods::Hold::kMotion}};
  const bool is_pinned =
      std::any_of(deployed.pins.begin(), deployed.pins.end(),
                  [&](const rods::JointPin& pin) { return pin.joint == anchor; });
  if (!is_pinned) deployed.pins.push_back({anchor, rods::Hold::kMotion});

  rods::LinkageModel model = live.model();
  RodSizes sizes = live.first_sizes();
  set_sizes(model, sizes);
  rods::LinkageEquilibrium equilibrium(model);
  rods::LinkageState closed = live.drawn();
  rods::EquilibriumReport report = equilibrium.solve(closed, flat, {}, job);
  if (report.converged() && sizes != live.sizes()) {
    report = follow_sizes(model, sizes, equilibrium, closed, flat, live.sizes(), job, {});
  }
  job.throw_if_cancelled();
  if (!report.converged()) {
    throw Error(ErrorCode::kFailedPrecondition, "flat",
                "the linkage has no equilibrium without angles that are set: " + report.message);
  }
  if (request.flat_angle) {
    if (model.graph().mixed_angles) {
      throw Error(
          ErrorCode::kInvalidArgument, "flat_angle",
          "a mean opening angle has no meaning in this linkage: what opens one joint closes "
          "the next");
    }
    const rods::Conditions free = flat;
    flat.mean_opening_angle = *request.flat_angle;
    close_to(equilibrium, closed, free, flat, job);
  } else if (!model.graph().mixed_angles && rods::is_without_stress(model, live.state())) {
    // If it opens without effort, no angle is definite when lengths change: the present one is
    // held.
    flat.mean_opening_angle = closed.mean_opening_angle();
  }
  options_.shortest = request.shortest;
  options_.longest = request.longest;
  options_.max_iterations = request.max_iterations;
  options_.shortest_lengths = request.shortest_lengths;
  options_.longest_lengths = request.longest_lengths;
  options_.thinnest = request.thinnest;
  options_.thickest = request.thickest;
  options_.thinnest_sections = request.thinnest_sections;
  options_.thickest_sections = request.thickest_sections;
  options_.guard = request.guard;
  rods::DesignPoint start{model.segment_lengths(), closed, live.state(), sizes.edges,
                          sizes.sections};
  // By now they are what those of segments say.
  if (request.variables.lengths == rods::LengthVariables::kSegments) start.edges.resize(0);
  start_area_ = rods::CellArea(model).value(start.deployed);
  rods::DesignCriteria criteria = this->criteria();
  criteria.energy_scale = energy_scale;
  design_.emplace(model, flat, deployed, std::move(start), std::move(criteria),
                  rods::DesignLimits{}, request.variables);
  options_.flat_height = 1;
  const double height = measure(design_->point()).flat_height;
  options_.flat_height = request.flat_height.value_or(kHeightRoom * height + kLeastHeight);
  const double angle = design_->values(design_->point()).smallest_angle;
  if (!smallest_angle_ && angle > kOpen) smallest_angle_ = kAngleShare * angle;
  if (smallest_angle_) options_.smallest_angle = *smallest_angle_;
  measure_here();
  start_point_ = design_->point();
  start_ = now_;
  begin_best();
}

/// For the present goal, at any size of the linkage.
rods::DesignCriteria LiveDesign::criteria() const {
  rods::DesignCriteria criteria;
  criteria.flat_share = goal_.flat_share;
  criteria.distance_weight = goal_.distance_weight;
  criteria.surface_weight = goal_.surface_weight;
  criteria.joint_surface_weights = goal_.joint_surface_weights;
  criteria.targets = goal_.targets;
  criteria.surface = goal_.placed_surface();
  if (criteria.surface)
    criteria.least_area = least_cover_ * std::min(start_area_, criteria.surface->area());
  return criteria;
}

DesignTerms LiveDesign::measure(const rods::DesignPoint& point) {
  const rods::DesignCriteria& criteria = design_->criteria();
  const rods::DesignValues values = design_->values(point);
  const auto& joints = point.deployed.joints();
  DesignTerms terms;
  terms.objective = values.objective;
  terms.flat_energy = values.flat_energy;
  terms.deployed_energy = values.deployed_energy;
  double sum = 0;
  for (const rods::JointTarget& target : criteria.targets)
    sum +=
        (joints[static_cast<std::size_t>(target.joint)].position - target.position).squaredNorm();
  if (!criteria.targets.empty())
    terms.target_rms = std::sqrt(sum / static_cast<double>(criteria.targets.size()));
  const auto count = static_cast<double>(joints.size());
  if (criteria.surface) {
    sum = 0;
    for (const auto& joint : joints)
      sum += (criteria.surface->closest(joint.position).position - joint.position).squaredNorm();
    terms.surface_rms = std::sqrt(sum / count);
    const double whole = criteria.surface->area(), start = std::min(start_area_, whole);
    terms.covered_area = std::min(values.deployed_area, whole);
    if (start > 0) terms.cover = terms.covered_area / start;
  }
  terms.flat_height = std::sqrt(values.flatness / count) / criteria.length_scale;
  terms.smallest_angle = values.smallest_angle;
  terms.holds = rank(terms).holds();
  return terms;
}

void LiveDesign::measure_here() {
  now_ = measure(design_->point());
  measured_ = design_->parameters();
}

/// The optimiser's measure.
rods::DesignRank LiveDesign::rank(const DesignTerms& terms) const {
  double room = 1 - std::pow(terms.flat_height / options_.flat_height, 2);
  if (smallest_angle_) room = std::min(room, terms.smallest_angle - *smallest_angle_);
  const double least_area = design_->criteria().least_area;
  if (least_area > 0) room = std::min(room, terms.covered_area / least_area - 1);
  return rods::DesignRank::of(terms.objective, room);
}

void LiveDesign::begin_best() {
  best_ = now_;
  best_iteration_ = iteration_;
  best_parameters_ = measured_;
  candidate_ = std::make_shared<const DesignCandidate>(DesignCandidate{
      sizes(), design_->variables().which(), design_->point().flat, design_->point().deployed});
}

/// If lengths are not varied, those of segments and edges keep their values.
RodSizes LiveDesign::sizes() const {
  const rods::DesignPoint& point = design_->point();
  return {point.lengths, point.edges, point.sections};
}

void LiveDesign::see_here() {
  measure_here();
  if (rank(now_).before(rank(best_))) begin_best();
}

void LiveDesign::set_goal(const DesignGoal& goal) {
  DesignGoal new_goal = goal;
  std::swap(goal_, new_goal);
  try {
    design_->set_criteria(criteria());
  } catch (...) {
    std::swap(goal_, new_goal);
    throw;
  }
  start_ = measure(*start_point_);
  measure_here();
  begin_best();
}

void LiveDesign::run(const JobContext& job, const OnStep& on_step, const OnEnd& on_end) {
  (void)rods::optimize_design(
      *design_, options_, job,
      [&](const rods::DesignProgress& progress, rods::LinkageDesign&) {
        iteration_ = progress.iteration;
        // The guard against buckling goes back to an earlier point where no trial was taken.
        if (progress.accepted || has_moved()) see_here();
        on_step({iteration_,
                 progress.accepted,
                 {progress.refused, progress.not_believed, progress.flat_lost, progress.guard > 0,
                  progress.refusal}});
      },
      [&](const rods::DesignReport& report, rods::LinkageDesign&) { on_end(report); });
}

bool LiveDesign::go_to_best() {
  const Eigen::VectorXd last = measured_;
  if (has_moved()) see_here();
  if (measured_ != best_parameters_) {
    design_->move_to(point_of(*candidate_));
    measured_ = best_parameters_;
    now_ = best_;
  }
  return measured_ != last;
}

DesignTerms LiveDesign::terms_of(const DesignCandidate& candidate) {
  return measure(point_of(candidate));
}

rods::DesignDifference LiveDesign::difference_from(const DesignCandidate& candidate) const {
  return rods::compare_designs(point_of(*candidate_), point_of(candidate));
}

Eigen::MatrixXd LiveDesign::shapes() const {
  const rods::DesignPoint& point = design_->point();
  Eigen::MatrixXd columns(shape_.size(), 2);
  columns.col(0) = shape_.coordinates(design_->model(), point.flat);
  columns.col(1) = shape_.coordinates(design_->model(), point.deployed);
  return columns;
}

std::string LiveDesign::release(const JobContext& job) const {
  const rods::DesignPoint& point = design_->point();
  const rods::LinkageModel& model = design_->model();
  const double size = extent();
  std::string remarks;
  for (const std::string& part :
       {now_.surface_rms + now_.target_rms > kMaxIgnoredDistanceShare * size
            ? describe_plane(model, point, size)
            : "",
        describe_flatness(model, point, size),
        describe_release(model, design_->flat(), design_->deployed(), point, job),
        describe_springing_up(model, design_->flat(), point, size, job)}) {
    if (!remarks.empty() && !part.empty()) remarks += "; ";
    remarks += part;
  }
  return remarks;
}

LiveDesign::FoundErection LiveDesign::find_erection(const JobContext& job) const {
  const rods::ErectionSearch search = rods::find_erection(
      design_->model(), design_->flat(), design_->deployed(), design_->point(), job);
  if (!search.found) return {nullptr, search.message};
  const rods::Erection& found = *search.found;
  const auto load_of = [&](const rods::JointLoad& load) {
    return scene::JointLoad{load.joint, load.force, length_unit_ * load.moment,
                            length_unit_ * load.opening_torque};
  };
  auto erection = std::make_shared<scene::LinkageErection>();
  erection->mean_angle = found.mean_angle;
  erection->path = found.angles;
  erection->path.front() = found.flat_angle;
  erection->path.back() = found.mean_angle;
  for (const double moment : found.moments) erection->path_moments.push_back(length_unit_ * moment);
  erection->distance = found.distance;
  erection->flat_positions = found.flat;
  erection->positions = found.open;
  for (const rods::JointLoad& load : found.push) erection->push.push_back(load_of(load));
  if (found.support) erection->support = load_of(*found.support);
  return {std::move(erection), ""};
}

double LiveDesign::mean_angle() const { return design_->point().deployed.mean_opening_angle(); }

}  // namespace limber::session
