#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/kinematics.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

/// The difference of shown frames from those of the reduced model, near the poses at which it was
/// found: q = H g(Y z) + D z + phi shift, with phi of LayeredKinematics.
struct FrameShift {
  std::shared_ptr<const Eigen::MatrixXd> basis;  // B of the shown frames, 3n x h'
  Eigen::MatrixXf shift;                         // h' x N
  Eigen::MatrixXd poses;                         // z0, R x N
};

/// 1 at z0, 1/2 at half of |z0| from there, quadratic at both: how far a correction that was found
/// at z0 counts at z. 0 where z0 is rest.
/// @returns phi of each column of z
[[nodiscard]] Eigen::VectorXd fading(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                     const Eigen::Ref<const Eigen::MatrixXd>& z0);

/// The kinematics that a live problem is solved with: the reduced model or the full rotation-strain
/// map. The owner chooses between solves, and tells the solver that its values have changed
/// (Solver::warm_start).
///
/// An anchor is a pose z0 of a frame at which a site was evaluated by both. Near it the reduced
/// model is corrected in value and Jacobian, so that an optimum of the full map is one of the
/// corrected model too: u = u_reduced + phi (a + B (z - z0)). Here a = u_full(z0) - u_reduced(z0),
/// B is the same of Jacobians, and phi = 1 / (1 + |z - z0|^2 / rho^2) with rho a share of |z0|: an
/// anchor has no effect on poses far away. Sites without an anchor get the shift of the shown
/// frame, so that shown frames meet the constraints.
///
/// Sites are added to the full map when it is first used after them.
class LayeredKinematics final : public Kinematics {
 public:
  enum class Level { kReduced, kFull };

  explicit LayeredKinematics(std::shared_ptr<ReducedKinematics> reduced);

  [[nodiscard]] const ReducedKinematics& reduced() const { return *reduced_; }
  SiteId add_site(const Site& site);
  SiteId add_site(const std::vector<int>& nodes) { return add_site(Site{nodes, {}}); }
  /// Its sites are those of this object from now on. @param full  without sites
  void set_full(std::unique_ptr<FullKinematics> full);
  [[nodiscard]] bool has_full() const { return full_ != nullptr; }
  /// kFull needs set_full().
  void use(Level level);
  /// Evaluations of the full map, those of use() and anchor() included, stop once `cancellation` is
  /// requested: FullKinematics::heed(). Needs set_full().
  void heed(const Cancellation& cancellation);
  [[nodiscard]] Level level() const { return level_; }
  /// Poses on top of the base motion, of both maps from now on; null: none. Take the solver's
  /// motion up again after it.
  void set_added(std::shared_ptr<const AddedPoses> added);
  /// Null: none, and no anchors either.
  void set_shift(std::shared_ptr<const FrameShift> shift);
  /// The corrections of the reduced model: shift and anchors.
  struct Corrections;
  /// Leaves none.
  [[nodiscard]] Corrections take_corrections();
  /// In place of those that there are. No site may have been added since they were taken.
  void give_back(Corrections corrections);
  /// Anchors at these poses, in place of all that there are. Needs set_full().
  /// @param frames, z, queries  as of evaluate()
  void anchor(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
              std::span<const SiteQuery> queries);

  [[nodiscard]] int coordinate_count() const override;
  [[nodiscard]] double length() const override;
  [[nodiscard]] bool moves(SiteId site) const override;
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override;
  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const override;

 private:
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  struct Anchor {
    Eigen::VectorXd pose;   // z0
    Eigen::Vector3d value;  // a [m]
    Rows jacobian;          // B [m]
  };
  /// phi and its first two derivatives' factors at one pose.
  struct Correction;
  void add_sites_to_full();
  /// @returns false if the site has no anchor in this frame
  [[nodiscard]] bool correct(SiteId site, int frame, const Eigen::Ref<const Eigen::VectorXd>& z,
                             Correction& correction) const;

  std::shared_ptr<ReducedKinematics> reduced_;
  std::unique_ptr<FullKinematics> full_;
  Level level_ = Level::kReduced;
  std::vector<Site> sites_;
  std::size_t sites_in_full_ = 0;
  std::shared_ptr<const AddedPoses> added_;
  std::shared_ptr<const FrameShift> shift_;
  std::vector<Rows> rows_;                            // of the shift's basis, of each site
  std::map<std::pair<SiteId, int>, Anchor> anchors_;  // by site and frame
};

struct LayeredKinematics::Corrections {
  std::shared_ptr<const FrameShift> shift;
  std::vector<Rows> rows;
  std::map<std::pair<SiteId, int>, Anchor> anchors;
};

}  // namespace limber::reduced
