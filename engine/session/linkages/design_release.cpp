#include "engine/session/linkages/design_release.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/degrees.h"
#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_assembly.h"

namespace limber::session {
namespace {

// Tolerances within which two shapes count as equal.
constexpr double kAngle = 1 * kDegree;  // of a joint's opening
constexpr double kDistance = 0.01;      // of a joint from the middle, of the farthest one's

constexpr double kFlat = 0.01;  // height as a share of the size: that is flat

/// Root mean square, over the plane nearest to the joints [length].
double height_of(const rods::LinkageModel& model, const rods::LinkageState& state) {
  return std::sqrt(rods::Flatness(model).value(state) / static_cast<double>(state.joints().size()));
}

Eigen::VectorXd distances_from_middle(const rods::LinkageState& state) {
  const Eigen::Matrix3Xd joints = rods::joint_positions(state);
  return (joints.colwise() - joints.rowwise().mean()).colwise().norm();
}

double largest_angle_between(const rods::LinkageState& a, const rods::LinkageState& b) {
  double largest = 0;
  for (std::size_t j = 0; j < a.joints().size(); ++j) {
    largest =
        std::max(largest, std::abs(a.joints()[j].opening_angle - b.joints()[j].opening_angle));
  }
  return largest;
}

}  // namespace

std::string describe_plane(const rods::LinkageModel& model, const rods::DesignPoint& point,
                           double length_scale) {
  constexpr double kPlane = 1e-6;  // of its size
  if (height_of(model, point.deployed) > kPlane * length_scale) return "";
  return "the deployed shape is planar: by symmetry no lengths near its own bring it out of the "
         "plane";
}

std::string describe_springing_up(const rods::LinkageModel& model, const rods::Conditions& flat,
                                  const rods::DesignPoint& point, double length_scale,
                                  const JobContext& job) {
  if (!flat.mean_opening_angle || rods::is_without_stress(model, point.flat)) return "";
  if (height_of(model, point.flat) > kFlat * length_scale) return "";
  rods::Conditions free = flat;
  free.mean_opening_angle.reset();
  rods::LinkageEquilibrium equilibrium(model);
  rods::LinkageState state = point.flat;
  const rods::DeploymentReport report =
      rods::deploy(equilibrium, state, flat, free, {}, JobContext{job.cancellation, {}});
  if (report.status == rods::DeploymentStatus::kCancelled) return "";
  if (report.status != rods::DeploymentStatus::kReached)
    return "whether it stays flat when it is released is unknown: " + report.message;
  const double height = height_of(model, state) / length_scale;
  if (height <= kFlat) return "";
  return fmt::format(
      "held at its mean angle of {:.1f} degrees the linkage is flat, released it opens to {:.1f} "
      "degrees and a height of {:.2e} of its size",
      *flat.mean_opening_angle / kDegree, state.mean_opening_angle() / kDegree, height);
}

std::string describe_flatness(const rods::LinkageModel& model, const rods::DesignPoint& point,
                              double length_scale) {
  constexpr double kMaxFlatHeightShare = 0.25;  // of the deployed shape's height
  const double flat = height_of(model, point.flat) / length_scale,
               deployed = height_of(model, point.deployed) / length_scale;
  if (flat <= std::max(kFlat, kMaxFlatHeightShare * deployed)) return "";
  return fmt::format(
      "the shape that is to be flat is not: its height is {:.2e} of its size, the deployed one's "
      "{:.2e} (flat_height asks for less)",
      flat, deployed);
}

std::string describe_release(const rods::LinkageModel& model, const rods::Conditions& flat,
                             const rods::Conditions& deployed, const rods::DesignPoint& point,
                             const JobContext& job) {
  rods::LinkageEquilibrium equilibrium(model);
  rods::LinkageState state = point.deployed;
  const rods::DeploymentReport report =
      rods::deploy(equilibrium, state, deployed, flat, {}, JobContext{job.cancellation, {}});
  if (report.status == rods::DeploymentStatus::kCancelled) return "";
  if (report.status != rods::DeploymentStatus::kReached)
    return "whether it falls flat when it is released is unknown: " + report.message;
  // A mechanism stays wherever it comes to lie.
  if (rods::is_without_stress(model, state) && rods::is_without_stress(model, point.flat))
    return "";
  rods::LinkageAssembly assembly(model);
  const double held_energy = assembly.energies(point.flat).total();
  const double found = assembly.energies(state).total();
  const Eigen::VectorXd places = distances_from_middle(point.flat);
  const double apart = (distances_from_middle(state) - places).cwiseAbs().maxCoeff();
  const double angle = largest_angle_between(state, point.flat);
  if (angle <= kAngle && apart <= kDistance * places.maxCoeff()) return "";
  return fmt::format(
      "released from this shape, the linkage does not fall to the flat one but to another, with "
      "{:g} times its energy and opening angles that differ by up to {:.1f} degrees",
      found / held_energy, angle / kDegree);
}

}  // namespace limber::session
