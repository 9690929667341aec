#include "engine/spacetime/pose_shares.h"

#include <memory>

#include "engine/base/error.h"
#include "engine/spacetime/solver.h"

namespace limber::spacetime {
namespace {

using Eigen::Index;

/// Kinematics of one mode that moves no place on the body.
class NoSites final : public reduced::Kinematics {
 public:
  [[nodiscard]] int coordinate_count() const override { return 1; }
  [[nodiscard]] double length() const override { return 1; }
  void evaluate(std::span<const int> /*frames*/, const Eigen::Ref<const Eigen::MatrixXd>& /*z*/,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    LIMBER_DEMAND(queries.empty());
    u.resize(3, 0);
    if (jacobian != nullptr) jacobian->resize(0, 1);
  }
};

/// The mean of the pose's modes.
ModeDynamics mean_mode(const Eigen::VectorXd& pose, const ModeDynamics& modes) {
  double energy = 0, kinetic = 0, damping = 0, cost = 0;
  Index lowest = modes.stiffness.size() - 1;  // of a pose that modes show nothing of
  for (Index i = lowest; i >= 0; --i) {
    if (!(modes.stiffness[i] > 0)) continue;
    lowest = i;
    const double square = pose[i] * pose[i], share = square / modes.stiffness[i];
    energy += square;
    cost += square * modes.stiffness[i] * modes.stiffness[i] * modes.force_weight(i) / modes.scale;
    kinetic += share;
    damping += modes.damping[i] * share;
  }
  ModeDynamics mean = modes;
  mean.stiffness.setConstant(1, kinetic > 0 ? energy / kinetic : modes.stiffness[lowest]);
  mean.damping.setConstant(1, kinetic > 0 ? damping / kinetic : modes.damping[lowest]);
  const double stiffest = mean.stiffness[0] * mean.stiffness[0] * energy;
  mean.shares.setConstant(1, cost > 0 && stiffest > 0 ? cost / stiffest : 1.0);
  return mean;
}

}  // namespace

Eigen::VectorXd pose_share(std::size_t pose, const std::vector<KeyframeConstraint>& keyframes,
                           const ModeDynamics& dynamics, const Timeline& timeline) {
  const Eigen::VectorXd& own = keyframes.at(pose).coordinates;
  const double size = own.norm() > 0 ? own.norm() : 1;
  Solver solver(std::make_shared<const NoSites>(), mean_mode(own, dynamics), timeline);
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const KeyframeConstraint& of = keyframes[k];
    solver.add_keyframe(
        {of.id, of.frame, Eigen::VectorXd::Constant(1, k == pose ? size : 0), of.weight});
  }
  solver.solve();
  if (!solver.motion().allFinite()) {
    throw Error(ErrorCode::kNumerical, "keyframes",
                "the way to the keyframe's pose has numbers that are not finite");
  }
  return solver.motion().row(0).transpose() / size;
}

}  // namespace limber::spacetime
