#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/reduced/base_load.h"
#include "engine/reduced/kinematics.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

enum class CubatureKind {
  kFittedMaps,  // q = sum_e H_e g_e, H_e a full h x 9 block per tet (default: a quarter of the
                // tets)
  kWeights,     // q = sum_e w_e P_e g_e, w_e >= 0 (paper: space-time editing, eq. 12)
};

/// Source of the basis B. Fields and frames of an input animation are joined by principal component
/// analysis in every case.
enum class BasisKind {
  kBest,       // kSnapshots and kMapDerivatives are built, and the better one for the size is taken
  kSnapshots,  // full reconstructions of training poses
  // Modes and their derivatives under StVK, lambda_1 / lambda_i and lambda_1^2 / (lambda_i
  // lambda_j) as weights (paper: space-time editing, section 3.1; Barbic and James 2005, 4.3).
  kModalDerivatives,
  // Modes and the second derivatives of the RS reconstruction along pairs of them, weighted as the
  // training poses have them.
  kMapDerivatives,
};

/// How a model is to be built: to a tolerance (the smallest h and the fewest tets that meet it) or
/// to given sizes.
struct ModelOptions {
  int mode_count = 30;  // elastic modes in W-hat (R without the rigid unknowns of a free body), > 0
  double tolerance =
      0.01;  // mean relative error of u on held-out poses, in (1e-6, 1); used where a size is 0
  int basis_size = 0;     // h; 0: chosen to meet the tolerance
  int cubature_size = 0;  // T; 0: chosen to meet the tolerance
  CubatureKind cubature = CubatureKind::kFittedMaps;
  BasisKind basis = BasisKind::kBest;
  // Maps are fitted to all, the basis to the first 800 (400 for more than 16,000 tets); >= 10.
  // 0: 2400; fewer in proportion above 40,000 tets, at least 600.
  int training_poses = 0;
  int test_poses = 100;  // >= 10, never shared with training
  double amplitude =
      0.5;  // typical largest displacement of a training pose, in body lengths, in (0, 10]
  std::uint64_t seed = 1;

  void validate() const;
};

struct ModelReport {
  double basis_error_mean = 0;  // projection on B alone, test poses, relative
  double error_mean = 0;  // whole reduced reconstruction against full RS, test poses, relative
  double error_max = 0;
  double small_error_mean = 0;  // same at a hundredth of the amplitude (the linear regime)
  bool met_tolerance = true;
  BasisKind basis = BasisKind::kSnapshots;  // the source of B, never kBest
  // Mean relative errors of the two methods alone with `compared_size` columns, on poses that had
  // no part in either (other ones than above); empty: not built.
  int compared_size = 0;
  std::optional<double> snapshot_basis_error;
  std::optional<double> derivative_basis_error;
  double modes_s = 0, poses_s = 0, basis_s = 0, cubature_s = 0;
  // Says so, with numbers, where the tolerance was not met and where the body has mechanisms.
  std::string message;
};

/// The reduced RS model of a body (paper: space-time editing, section 3). It is a plain value that
/// is cached on disk:
///   u = B q,  q = H g(Y z) + D z
/// z is unitless. Column k of W-hat is the mass-orthonormal mode times c / sqrt(lambda_k /
/// lambda_1). The factor c makes z_1 = 1 move the farthest node by one body length, and lambda_1 is
/// the first eigenvalue that is neither rigid nor of a mechanism. A mechanism's column is the mode
/// times c. A free body has six unknowns first: translations in body lengths (through D only) and
/// rotations in radians.
struct ReducedModel {
  int node_count = 0;           // n, compact nodes
  double length = 0;            // [m]
  int rigid_count = 0;          // 0 or 6
  int mechanism_count = 0;      // after the rigid ones: without stiffness (bodies::ModalBasis)
  Eigen::VectorXd eigenvalues;  // R [1/s^2], zero for rigid unknowns
  Eigen::MatrixXd modes;        // W-hat, 3n x R [m]
  Eigen::MatrixXd basis;        // B, 3n x h, orthonormal columns
  std::vector<int> tets;        // T compact tet ids
  Eigen::MatrixXd rs_modes;     // Y = (Q W-hat)^c, 9T x R
  Eigen::MatrixXd map;          // H, h x 9T
  Eigen::MatrixXd direct;       // D, h x R
  ModelReport report;

  [[nodiscard]] int coordinate_count() const { return static_cast<int>(eigenvalues.size()); }
  [[nodiscard]] int basis_size() const { return static_cast<int>(basis.cols()); }
  [[nodiscard]] int cubature_size() const { return static_cast<int>(tets.size()); }
};

/// Builds a model. `animation` (3n x frames [m], may be empty) is an input motion that the basis
/// must span too: up to 200 of its frames join the snapshots. Deterministic for given inputs,
/// for any number of threads.
/// @throws Error for bad options, cancelled jobs, failed eigensolves.
[[nodiscard]] ReducedModel build_model(const bodies::ElasticBody& body, const ModelOptions& options,
                                       const JobContext& job = {},
                                       const Eigen::MatrixXd& animation = {});

/// A quick model, shown until build_model() has made the requested one. It has ten modes at most
/// and a mean error of 5 % against full reconstructions of these modes. Above 60,000 tets the modes
/// are bodies::smooth_modes(), whose frequencies are up to 60 % too high on branching bodies (5 %
/// on bars). report.met_tolerance says whether options.tolerance is met.
/// @throws as build_model()
[[nodiscard]] ReducedModel build_first_model(const bodies::ElasticBody& body,
                                             const ModelOptions& options,
                                             const JobContext& job = {});

/// The model with more columns of B, 3n x c, orthonormal and orthogonal to B. They show only
/// additions to q, since H g(Y z) has no part in them.
[[nodiscard]] ReducedModel with_columns(ReducedModel model,
                                        const Eigen::Ref<const Eigen::MatrixXd>& columns);

/// A base motion in RS coordinates (paper, section 6.1): y = y_base + Y z. Built from an input
/// animation.
struct BaseMotion {
  Eigen::MatrixXd rs;      // 9T x N, RS coordinates of the cubature tets
  Eigen::MatrixXd direct;  // h x N, added to q (rigid translation of the frames of a free body)
  BaseLoad load;           // of all R columns of W-hat
};

/// No tet loses a full turn in time, for steps of less than half a turn. z adds to theta, and next
/// to a full turn the derivative of exp has rank one: the rotations of z across theta have almost
/// no effect there. A body that spins and wobbles passes a full turn while its theta swings from
/// the spin's axis through directions across it, in wobble / step frames (both rad). The
/// contribution of z swings with it, and jumps by about wobble / (pi k) of itself where the k-th
/// turn is found again. With steps longer than the wobble all that happens between two frames. z =
/// 0 is not affected.
/// @param displacements  3n x N from rest [m], frame by frame
/// @throws Error{kInvalidArgument} for other sizes or numbers that are not finite,
/// Error{kCancelled}
[[nodiscard]] BaseMotion base_motion(const bodies::ElasticBody& body, const ReducedModel& model,
                                     const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                     const JobContext& job = {});

class AddedPoses;

/// Kinematics of a reduced model, with batch evaluation of whole motions.
class ReducedKinematics final : public Kinematics {
 public:
  explicit ReducedKinematics(std::shared_ptr<const ReducedModel> model,
                             std::shared_ptr<const BaseMotion> base = nullptr);
  ~ReducedKinematics() override;

  /// Registers (or finds) a site: call before solving, not during.
  /// @throws as SiteList::add()
  SiteId add_site(const Site& site);
  /// The mean of a group, with equal weights.
  SiteId add_site(const std::vector<int>& nodes) { return add_site(Site{nodes, {}}); }
  /// Poses on top of the base motion (with_poses()); null: none. As add_site(), between solves.
  void set_added(const AddedPoses* added);

  [[nodiscard]] int coordinate_count() const override;
  [[nodiscard]] bool moves(SiteId site) const override;
  [[nodiscard]] double length() const override;
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override;
  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const override;

  /// Reduced coordinates of frames first .. first + z.cols() - 1, float32, ready to stream: q is h
  /// x z.cols().
  void coordinates(int first, const Eigen::Ref<const Eigen::MatrixXd>& z, Eigen::MatrixXf& q) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::reduced
