#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/reduced/added_poses.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/kinematics.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

/// Kinematics of sites by the full rotation-strain map, without basis and cubature: the values that
/// FullReconstruction and FullShapes give for the same z, and their derivatives. A site costs one
/// scalar Laplacian solve when it is added, A Phi = (weights of its nodes); then
///   u = sum over tets of g(y(W-hat z)) p_e,   p_e = V grad Phi,
/// is one pass over the tets, and so is the pull-back of its Jacobian to nodes (adjoint of g and
/// Q). Exact but for rounding, at a cost that grows with tets times distinct sites.
///
/// Call add_site() from one thread and not during other calls. The rest is thread-safe and runs on
/// all threads over the queries, with results that do not depend on their number.
class FullKinematics final : public Kinematics {
 public:
  /// @param body  that the model was built of
  /// @param model  its modes W-hat and length are used
  /// @param reconstruction  of the body
  /// @param base  displacements of the base motion, 3n x N [m]; empty: none
  FullKinematics(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
                 std::shared_ptr<const FullReconstruction> reconstruction,
                 Eigen::MatrixXd base = {});
  ~FullKinematics() override;

  /// Registers (or finds) a site, as ReducedKinematics: the same calls give the same ids.
  SiteId add_site(const Site& site);
  SiteId add_site(const std::vector<int>& nodes) { return add_site(Site{nodes, {}}); }
  /// Poses on top of the base motion; null: none. As add_site(), not during other calls.
  void set_added(std::shared_ptr<const AddedPoses> added);
  /// From now on add_site(), evaluate() and curvature() throw Error{kCancelled} within about a
  /// millisecond once it is requested. As add_site(), not during other calls.
  void heed(Cancellation cancellation);

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
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::reduced
