#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/reduced/kinematics.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced {

/// A body's shapes as functions of z: for the solver one of the Kinematics it can edit in, for
/// comparisons whole shapes: the four that the field compares (paper: space-time editing, figure
/// 2). All take the same z of a body, in the scales of ScaledModes. Over a base motion, linear
/// modes and modal warping add their offset to its displacements; full and reduced RS add y = Q W z
/// to its RS coordinates (section 6.1).
///
/// The editor of Barbic, Sin and Grinspun 2012 is two of them: z solved for in the linear one, and
/// `displacements` of that z in the full one (its warp of linear offsets, over the same base
/// motion). Nodes then leave the targets they met.
class Reconstruction : public Kinematics {
 public:
  /// Registers (or finds) the site "mean displacement of these compact nodes": call before solving,
  /// not during.
  /// @throws Error{kInvalidArgument} for no nodes, Error{kOutOfRange} naming the node
  virtual SiteId add_site(const std::vector<int>& nodes) = 0;

  /// Shapes of frames first .. first + z.cols() - 1, 3n x z.cols() [m], base motion included.
  [[nodiscard]] virtual Eigen::MatrixXd displacements(
      int first, const Eigen::Ref<const Eigen::MatrixXd>& z) const = 0;
};

/// u = W z, plus the frame's base displacement.
/// @param base  3n x N [m], or empty
[[nodiscard]] std::unique_ptr<Reconstruction> make_linear_reconstruction(
    const bodies::ElasticBody& body, const ScaledModes& modes, const Eigen::MatrixXd& base = {});

/// Modal warping: u_i = (int_0^1 exp(t w_i^x) dt) (W z)_i with the rotation vector of node i,
/// w = Psi z: half the curl of each mode, averaged by volume over the tets at the node. Rotations
/// about the centre of mass of a free body are exact. Base as above.
[[nodiscard]] std::unique_ptr<Reconstruction> make_warped_reconstruction(
    const bodies::ElasticBody& body, const ScaledModes& modes, const Eigen::MatrixXd& base = {});

/// Full RS. A site's displacement is linear in g(y), so that one solve per site, ahead, gives the
/// row: a query costs a pass over all tets and no solve. `displacements` solves per frame.
/// @param base  3n x N [m], or empty; its RS coordinates are kept (9 m N numbers)
[[nodiscard]] std::unique_ptr<Reconstruction> make_full_reconstruction(
    const bodies::ElasticBody& body, const ScaledModes& modes, const Eigen::MatrixXd& base = {},
    const JobContext& job = {});

/// ReducedKinematics with shapes. Frames of `displacements` in single precision, as streamed.
[[nodiscard]] std::unique_ptr<Reconstruction> make_reduced_reconstruction(
    std::shared_ptr<const ReducedModel> model, std::shared_ptr<const BaseMotion> base = nullptr);

}  // namespace limber::reduced
