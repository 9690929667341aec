#include "engine/spacetime/pose_shares.h"

#include <memory>

#include "engine/base/error.h"
#include "engine/spacetime/solver.h"

namespace limber::spacetime {
namespace {

using Eigen::Index;

/// Of modes that no place on the body depends on.
class NoSites final : public reduced::Kinematics {
 public:
  explicit NoSites(int modes) : modes_(modes) {}
  [[nodiscard]] int coordinate_count() const override { return modes_; }
  [[nodiscard]] double length() const override { return 1; }
  void evaluate(std::span<const int> /*frames*/, const Eigen::Ref<const Eigen::MatrixXd>& /*z*/,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    LIMBER_DEMAND(queries.empty());
    u.resize(3, 0);
    if (jacobian != nullptr) jacobian->resize(0, modes_);
  }

 private:
  int modes_;
};

/// Sets mode k of `all` to the mean of the pose's modes.
void set_mean_mode(const Eigen::VectorXd& pose, const ModeDynamics& modes, Index k,
                   ModeDynamics& all) {
  double energy = 0, kinetic = 0, damping = 0;
  for (Index i = 0; i < modes.stiffness.size(); ++i) {
    if (!(modes.stiffness[i] > 0)) continue;
    const double square = pose[i] * pose[i], share = square / modes.stiffness[i];
    energy += square;
    kinetic += share;
    damping += modes.damping[i] * share;
  }
  Index lowest = modes.stiffness.size() - 1;  // of a pose that modes show nothing of
  for (Index i = lowest; i >= 0; --i)
    if (modes.stiffness[i] > 0) lowest = i;
  all.stiffness[k] = kinetic > 0 ? energy / kinetic : modes.stiffness[lowest];
  all.damping[k] = kinetic > 0 ? damping / kinetic : modes.damping[lowest];
}

}  // namespace

Eigen::MatrixXd pose_shares(const std::vector<KeyframeConstraint>& keyframes,
                            const ModeDynamics& dynamics, const Timeline& timeline) {
  const auto count = static_cast<Index>(keyframes.size());
  if (count == 0) return {};
  ModeDynamics means = dynamics;
  means.stiffness.resize(count);
  means.damping.resize(count);
  Eigen::VectorXd sizes(count);
  for (Index k = 0; k < count; ++k) {
    const Eigen::VectorXd& pose = keyframes[static_cast<std::size_t>(k)].coordinates;
    set_mean_mode(pose, dynamics, k, means);
    sizes[k] = pose.norm() > 0 ? pose.norm() : 1;
  }
  Solver solver(std::make_shared<const NoSites>(static_cast<int>(count)), std::move(means),
                timeline);
  for (Index k = 0; k < count; ++k) {
    KeyframeConstraint alone = keyframes[static_cast<std::size_t>(k)];
    alone.coordinates = sizes[k] * Eigen::VectorXd::Unit(count, k);
    solver.add_keyframe(alone);
  }
  solver.solve();
  return sizes.cwiseInverse().asDiagonal() * solver.motion();
}

}  // namespace limber::spacetime
