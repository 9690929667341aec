#include "engine/session/linkage/design_release.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_assembly.h"

namespace limber::session {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
// What two shapes that are the same may differ by.
constexpr double kAngle = 1 * kDegree;  // of a joint's opening
constexpr double kDistance = 0.01;      // of a joint from the middle, of the farthest one's

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

std::string told_flatness(const rods::LinkageModel& model, const rods::DesignPoint& point,
                          double length_scale) {
  constexpr double kFlat = 0.01;   // of its size: that is flat, whatever the other is
  constexpr double kShare = 0.25;  // of the deployed shape's height
  rods::Flatness flatness(model);
  const auto height = [&](const rods::LinkageState& state) {
    const auto count = static_cast<double>(state.joints().size());
    return std::sqrt(flatness.value(state) / count) / length_scale;
  };
  const double flat = height(point.flat), deployed = height(point.deployed);
  if (flat <= std::max(kFlat, kShare * deployed)) return "";
  return fmt::format(
      "the shape without angles is not flat: its height is {:.2e} of its size, the deployed one's "
      "{:.2e} (flat_height asks for less)",
      flat, deployed);
}

std::string told_release(const rods::LinkageModel& model, const rods::Conditions& flat,
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
  const double wanted = assembly.energies(point.flat).total();
  const double found = assembly.energies(state).total();
  const Eigen::VectorXd places = distances_from_middle(point.flat);
  const double apart = (distances_from_middle(state) - places).cwiseAbs().maxCoeff();
  const double angle = largest_angle_between(state, point.flat);
  if (angle <= kAngle && apart <= kDistance * places.maxCoeff()) return "";
  return fmt::format(
      "released from this shape, the linkage does not fall to the flat one but to another, with "
      "{:g} times its energy and opening angles that differ by up to {:.1f} degrees",
      found / wanted, angle / kDegree);
}

}  // namespace limber::session
