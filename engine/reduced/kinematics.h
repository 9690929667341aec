#pragma once

#include <Eigen/Core>
#include <span>

namespace limber::reduced {

/// A place whose displacement can be evaluated: a node, or the mean of several, equal or weighted
/// (reduced::Site). Issued by the model.
using SiteId = int;

/// "The displacement of `site` in the pose given by column `column` of z."
struct SiteQuery {
  SiteId site;
  int column;
};

/// All that the space-time solver may know of a body: displacements of sites and their Jacobians,
/// as functions of modal coordinates. Tets, bases and cubature are behind it. Implementations are
/// immutable and thread-safe.
class Kinematics {
 public:
  virtual ~Kinematics() = default;

  /// R, the number of modal coordinates of W-hat (rigid unknowns of a free body included, first).
  [[nodiscard]] virtual int coordinate_count() const = 0;

  /// The length that makes displacements unitless: the body's length() [m].
  [[nodiscard]] virtual double length() const = 0;

  /// False for a site that no z moves, since all its nodes are fixed: only the base motion does.
  [[nodiscard]] virtual bool moves(SiteId /*site*/) const { return true; }

  /// @param frames   per column of z its frame (selects the base motion, where there is one)
  /// @param z        R x columns, modal RS coordinates (unitless)
  /// @param queries  q of them; columns may be shared by many queries. Unknown sites and columns
  /// are refused:
  ///                 Error{kOutOfRange}
  /// @param u        out, 3 x q: displacement from rest [m], base motion included
  /// @param jacobian out, (3 q) x R, rows 3i..3i+2 are d u_i / d z at its column [m]; nullptr: not
  /// wanted
  /// @throws Error{kCancelled}  if its owner has cancelled it; so does curvature()
  virtual void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                        std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                        Eigen::MatrixXd* jacobian) const = 0;

  /// Second derivatives of a weighted sum of displacements, for Newton's method.
  /// @param multipliers  3 x q [1/m]
  /// @param out          R x (R columns): block c is sum_i multipliers_i . d2 u_i / dz2 over the
  /// queries of column c,
  ///                     symmetric. The default differences Jacobians (relative accuracy about
  ///                     1e-9).
  virtual void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                         std::span<const SiteQuery> queries,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                         Eigen::MatrixXd& out) const;
};

}  // namespace limber::reduced
