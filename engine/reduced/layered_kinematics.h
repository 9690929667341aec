#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/kinematics.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

/// By how much shown frames differ from those of the reduced model: q = H g(Y z) + D z + shift.
struct FrameShift {
  std::shared_ptr<const Eigen::MatrixXd> basis;  // B of the shown frames, 3n x h'
  Eigen::MatrixXf shift;                         // h' x N
};

/// The kinematics that a live problem is solved with: the reduced model, shifted in each frame by
/// what the last full reconstruction differed from it, so that constraints are met in the frames
/// that are shown; or the full rotation-strain map. The owner chooses between solves, and tells the
/// solver that its values have changed (Solver::warm_start).
///
/// Sites are added to the full map when it is first used after them.
class LayeredKinematics final : public Kinematics {
 public:
  enum class Level { kReduced, kFull };

  explicit LayeredKinematics(std::shared_ptr<ReducedKinematics> reduced);

  [[nodiscard]] const ReducedKinematics& reduced() const { return *reduced_; }
  SiteId add_site(const std::vector<int>& nodes);
  /// Its sites are those of this object from now on. @param full  without sites
  void set_full(std::unique_ptr<FullKinematics> full);
  [[nodiscard]] bool has_full() const { return full_ != nullptr; }
  /// kFull needs set_full().
  void use(Level level);
  [[nodiscard]] Level level() const { return level_; }
  /// Null: none.
  void set_shift(std::shared_ptr<const FrameShift> shift);

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
  [[nodiscard]] Rows rows_of(const std::vector<int>& nodes) const;

  std::shared_ptr<ReducedKinematics> reduced_;
  std::unique_ptr<FullKinematics> full_;
  Level level_ = Level::kReduced;
  std::vector<std::vector<int>> sites_;
  std::size_t sites_in_full_ = 0;
  std::shared_ptr<const FrameShift> shift_;
  std::vector<Rows> rows_;  // of the shift's basis, of each site
};

}  // namespace limber::reduced
