#include "engine/beams/model/loose_spins.h"

#include <Eigen/Eigenvalues>

#include "engine/base/index.h"

namespace limber::beams {

namespace {

// Squares of the angles between axes that count as one.
constexpr double kSameAxis = 1e-12;

}  // namespace

std::vector<Eigen::Matrix3d> spin_resistances(const BeamModel& model) {
  std::vector<Eigen::Matrix3d> result(model.nodes.size(), Eigen::Matrix3d::Zero());
  const auto hold = [](const Eigen::Matrix3d& axes, std::size_t k, Eigen::Matrix3d& resistance) {
    const Eigen::Vector3d axis = axes.col(static_cast<Eigen::Index>(k));
    resistance += axis * axis.transpose();
  };
  for (int i = 0; i < static_cast<int>(model.elements.size()); ++i) {
    const BeamElement& e = model.elements[index(i)];
    if (e.kind == BeamKind::kCable) continue;
    const Eigen::Matrix3d frame = drawn_frame(model, i);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!e.start_release.rotations[k]) hold(frame, k, result[index(e.start)]);
      if (!e.finish_release.rotations[k]) hold(frame, k, result[index(e.finish)]);
    }
  }
  for (const BeamSupport& s : model.supports) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (s.fixed[3 + k]) hold(s.axes, k, result[index(s.node)]);
    }
  }
  for (const PrescribedMotion& m : model.motions) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (m.rotates[k]) hold(m.axes, k, result[index(m.node)]);
    }
  }
  return result;
}

Eigen::Vector3d unresisted(const Eigen::Matrix3d& resistance, const Eigen::Vector3d& moment) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(resistance);
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (solver.eigenvalues()[k] > kSameAxis) continue;
    const Eigen::Vector3d axis = solver.eigenvectors().col(k);
    result += axis.dot(moment) * axis;
  }
  return result;
}

}  // namespace limber::beams
