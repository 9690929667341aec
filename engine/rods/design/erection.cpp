#include "engine/rods/design/erection.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/rods/design/placed_surface.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/linkage_forces.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/joint_positions.h"

namespace limber::rods {
namespace {

constexpr double kSameShape = 1e-4;   // of the extent: distance of shapes that are one
constexpr double kPlane = 1e-6;       // of the extent: height of plane shapes
constexpr double kPushShare = 0.3;    // of E I/L^2, as starting grids are pushed
constexpr int kMaxIterations = 4000;  // Newton steps of all openings, after which none begins
// Shares of the path, of the first opening and of the one that confirms it.
constexpr double kStep = 0.03, kShortStep = 0.02;

int middle_joint(const LinkageState& state) {
  const Eigen::Matrix3Xd joints = joint_positions(state);
  Eigen::Index middle = 0;
  (joints.colwise() - joints.rowwise().mean()).colwise().norm().minCoeff(&middle);
  return static_cast<int>(middle);
}

/// Least squares; its normal may point to either side.
Plane nearest_plane(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd offsets = points.colwise() - mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(offsets * offsets.transpose());
  return {mean, axes.eigenvectors().col(0)};
}

Eigen::VectorXd heights_over(const Plane& plane, const Eigen::Matrix3Xd& points) {
  return (plane.normal.transpose() * (points.colwise() - plane.point)).transpose();
}

double rms(const Eigen::VectorXd& values) {
  return values.norm() / std::sqrt(static_cast<double>(std::max<Eigen::Index>(1, values.size())));
}

/// Along the flat shape's normal, by the deployed shape's heights beyond the flat one's; nothing
/// where it has none.
std::vector<JointLoad> erecting_push(const LinkageModel& model, const DesignPoint& point) {
  const Eigen::Matrix3Xd flat = joint_positions(point.flat);
  const Plane plane = nearest_plane(flat);
  Eigen::VectorXd heights =
      heights_over(plane, joint_positions(point.deployed)) - heights_over(plane, flat);
  heights.array() -= heights.mean();
  const double highest = heights.cwiseAbs().maxCoeff();
  const double extent = detail::UnknownScales(model).extent();
  if (!(highest > kPlane * extent)) return {};
  const RodStiffness& rods = model.stiffness();
  const double force = kPushShare * std::min(rods.bending_1, rods.bending_2) / (extent * extent);
  std::vector<JointLoad> push;
  for (Eigen::Index j = 0; j < heights.size(); ++j)
    push.push_back({static_cast<int>(j), force * heights[j] / highest * plane.normal});
  return push;
}

std::vector<JointLoad> scaled(std::vector<JointLoad> push, double factor) {
  for (JointLoad& load : push) load.force *= factor;
  return push;
}

struct Opened {
  bool reached = false;
  int iterations = 0;  // Newton steps
  double distance = 0;
  std::string message;
  Eigen::Matrix3Xd open;
  std::vector<double> angles, moments;  // see Erection
  std::optional<JointLoad> support;
};

/// Notes the forces that hold the linkage at a step of its opening.
void note_forces(const LinkageModel& model, const LinkageState& state, const Conditions& stage,
                 Opened& opened) {
  const LinkageForces forces = forces_in(model, state, stage);
  opened.angles.push_back(state.mean_opening_angle());
  opened.moments.push_back(forces.opening_moment);
  if (!opened.support) return;
  JointLoad& support = *opened.support;
  support.force =
      support.force.cwiseMax(forces.reaction_forces.col(support.joint).cwiseAbs()).eval();
  support.moment =
      support.moment.cwiseMax(forces.reaction_moments.col(support.joint).cwiseAbs()).eval();
}

/// Keeps so many of the steps that a plan stays short; the first and the last are among them.
void thin_out(std::vector<double>& values) {
  constexpr std::size_t kPlanned = 9;
  if (values.size() <= kPlanned) return;
  std::vector<double> kept;
  for (std::size_t i = 0; i < kPlanned; ++i)
    kept.push_back(values[i * (values.size() - 1) / (kPlanned - 1)]);
  values = std::move(kept);
}

Opened open(const LinkageModel& model, const Conditions& flat, const Conditions& deployed,
            const DesignPoint& point, const std::vector<JointLoad>& push, double step,
            const JobContext& job) {
  LinkageEquilibrium equilibrium(model);
  LinkageState state = point.flat;
  Conditions held = flat;
  Opened opened;
  const std::vector<Conditions> stages = erection_stages(point.flat, deployed, push);
  const std::size_t opening = stages.size() > 1 ? 1 : 0;
  const auto holds_motion = [](const JointPin& pin) { return pin.hold != Hold::kAngle; };
  const auto& pins = stages[opening].pins;
  const auto held_joint = std::find_if(pins.begin(), pins.end(), holds_motion);
  if (held_joint != pins.end()) opened.support = JointLoad{held_joint->joint};
  DeploymentOptions options;
  options.smallest_step = step / 64;
  options.most_ends = 5;
  options.most_iterations = 500;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const Conditions& stage = stages[k];
    if (k == opening) note_forces(model, state, k > 0 ? stages[0] : flat, opened);
    const bool opens =
        std::abs(*stage.mean_opening_angle - state.mean_opening_angle()) > 1e-6;  // [rad]
    options.first_step = options.largest_step = opens ? step : 0.25;
    const DeploymentReport report =
        deploy(equilibrium, state, held, stage, options, JobContext{job.cancellation, {}},
               [&](const DeploymentStep&, const LinkageState& at) {
                 if (k == opening) note_forces(model, at, stage, opened);
               });
    job.throw_if_cancelled();
    opened.iterations += report.iterations;
    opened.message = report.message;
    if (report.status != DeploymentStatus::kReached) return opened;
    held = stage;
  }
  opened.reached = true;
  opened.open = joint_positions(state);
  opened.distance = distance_between_shapes(opened.open, joint_positions(point.deployed));
  thin_out(opened.angles);
  thin_out(opened.moments);
  if (!opened.moments.empty())
    opened.moments.back() = forces_in(model, state, deployed).opening_moment;
  return opened;
}

}  // namespace

std::vector<JointLoad> turned_push(const std::vector<JointLoad>& push, const Eigen::Matrix3Xd& flat,
                                   const Eigen::Matrix3Xd& joints) {
  const Eigen::Matrix3d turn = fitted({}, flat, joints).rotation.toRotationMatrix();
  std::vector<JointLoad> turned = push;
  for (JointLoad& load : turned) {
    load.force = (turn * load.force).eval();
    load.moment = (turn * load.moment).eval();
  }
  return turned;
}

double distance_between_shapes(const LinkageState& a, const LinkageState& b) {
  return distance_between_shapes(joint_positions(a), joint_positions(b));
}

double distance_to_mirror_image(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return distance_between_shapes(a, -b);
}

double distance_between_shapes(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const SurfacePlacement moved = fitted({}, from, to);
  const Eigen::Matrix3Xd apart =
      ((moved.rotation.toRotationMatrix() * from).colwise() + moved.translation) - to;
  return rms(apart.colwise().norm().transpose());
}

std::vector<Conditions> erection_stages(const LinkageState& flat, const Conditions& to,
                                        const std::vector<JointLoad>& push,
                                        std::optional<int> support) {
  if (push.empty()) return {to};
  Conditions pushed = to;
  pushed.loads.insert(pushed.loads.end(), push.begin(), push.end());
  const bool is_held = std::any_of(to.pins.begin(), to.pins.end(),
                                   [](const JointPin& pin) { return pin.hold != Hold::kAngle; });
  if (!is_held) {
    const int middle = support.value_or(middle_joint(flat));
    const auto pin = std::find_if(pushed.pins.begin(), pushed.pins.end(),
                                  [&](const JointPin& other) { return other.joint == middle; });
    if (pin != pushed.pins.end()) {
      pin->hold = Hold::kMotionAndAngle;
    } else {
      pushed.pins.push_back({middle, Hold::kMotion});
    }
  }
  Conditions first = pushed;
  first.mean_opening_angle = flat.mean_opening_angle();
  return {first, pushed, to};
}

ErectionSearch find_erection(const LinkageModel& model, const Conditions& flat,
                             const Conditions& deployed, const DesignPoint& point,
                             const JobContext& job) {
  if (!deployed.mean_opening_angle) {
    return {std::nullopt,
            "no erection was looked for: no mean angle is set that the flat shape could be opened "
            "to"};
  }
  const double extent = detail::UnknownScales(model).extent();
  const Eigen::Matrix3Xd joints = joint_positions(point.flat);
  const bool in_plane = rms(heights_over(nearest_plane(joints), joints)) <= kPlane * extent;
  const std::vector<JointLoad> push = erecting_push(model, point);
  std::vector<std::vector<JointLoad>> tries;
  if (!in_plane || push.empty()) tries.emplace_back();
  if (!push.empty())
    for (const double factor : {1.0, 4.0, 16.0}) tries.push_back(scaled(push, factor));
  double nearest = std::numeric_limits<double>::infinity();
  std::string stopped;
  int iterations = 0;
  for (const std::vector<JointLoad>& tried : tries) {
    if (iterations > kMaxIterations) break;
    Opened opened;
    for (const double step : {kStep, kShortStep}) {
      opened = open(model, flat, deployed, point, tried, step, job);
      iterations += opened.iterations;
      if (!opened.reached || opened.distance > kSameShape * extent) break;
    }
    if (!opened.reached) {
      stopped = opened.message;
      continue;
    }
    nearest = std::min(nearest, opened.distance);
    if (opened.distance > kSameShape * extent) continue;
    Erection found;
    found.flat_angle = point.flat.mean_opening_angle();
    found.mean_angle = *deployed.mean_opening_angle;
    found.push = tried;
    found.distance = opened.distance;
    found.flat = joints;
    found.open = std::move(opened.open);
    found.angles = std::move(opened.angles);
    found.moments = std::move(opened.moments);
    found.support = opened.support;
    return {std::move(found), ""};
  }
  if (std::isfinite(nearest)) {
    return {std::nullopt, fmt::format("opened from flat, with and without forces that push it out "
                                      "of its plane, the linkage reaches another shape, {:.3g} "
                                      "away (rms of joints): no erection was found",
                                      nearest)};
  }
  return {std::nullopt, "opened from flat, the linkage does not reach the designed angle: " +
                            stopped + "; no erection was found"};
}

}  // namespace limber::rods
