#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"

// The two inner loops of ReducedKinematics. Both keep y and g component by component ("structure of
// arrays"), so that one register holds the same component of several tets (tangent) or of several
// frames (stream).

namespace limber::reduced {

/// A model laid out for displacements and Jacobians in double precision. Row c * padded + t of
/// rs_modes is component c of cubature tet t. Tets are padded with zeros to whole registers.
struct TangentTables {
  int padded = 0;            // tets, rounded up
  Eigen::MatrixXd rs_modes;  // Y, 9 padded x R
  Eigen::MatrixXd base_rs;   // 9 padded x N, or empty

  TangentTables() = default;
  TangentTables(const ReducedModel& model, const BaseMotion* base);
  [[nodiscard]] Eigen::Index rows() const { return kRsSize * Eigen::Index{padded}; }
};

/// Tables of a site: u = map g + direct z (+ basis q_base).
struct SiteTables {
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
  Rows map;     // B_site H, 3 x 9 padded
  Rows direct;  // B_site D, 3 x R
  Rows basis;   // B_site, 3 x h

  SiteTables(const ReducedModel& model, const TangentTables& tables,
             const Eigen::MatrixXd& basis_rows);
};

/// Scratch of one evaluation, reused between calls: no allocation once it has grown.
struct TangentWorkspace {
  std::vector<int> slot;     // per column of z its place in `columns`, -1 if not requested
  std::vector<int> columns;  // distinct columns
  Eigen::MatrixXd z, y, g;   // per slot one column
  Eigen::MatrixXd rotation;  // 9 padded x slots: R
  Eigen::MatrixXd spin;      // 27 padded x slots: d g / d theta, axis by axis
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>
      chain;  // (3 q) x 9 padded: M dg/dy

  void begin(const TangentTables& tables, const Eigen::Ref<const Eigen::MatrixXd>& all_z,
             std::span<const SiteQuery> queries);
  void evaluate(const TangentTables& tables, std::span<const int> frames,
                const Eigen::Ref<const Eigen::MatrixXd>& all_z, bool derivatives);
  [[nodiscard]] auto gradient(int s) const { return g.col(s); }
  /// Rows first .. first + 2 of `chain`.
  void chain_rows(const TangentTables& tables, const SiteTables& site, int s, Eigen::Index first);
};

/// Second derivatives at one pose: Y^T K Y with K the second derivatives of p . g(y), tet by tet.
struct CurvatureWorkspace {
  Eigen::VectorXd force;    // p, 9 padded: sum over queries of map^T m
  Eigen::VectorXd second;   // 27 padded: d2 (p . g) / d theta_a d y_c at (9 a + c) padded + t
  Eigen::MatrixXd product;  // K Y

  /// @param padded  tets, a whole number of registers; y and p have 9 padded entries
  void add_tets(int padded, const double* y, const double* p);
  void multiply(const TangentTables& tables);
};

/// A model laid out for streaming coordinates in single precision:
///   q = H r(y) + D' z + q',   r = g - g'(0) y,   D' = D + H g'(0) Y.
/// This form keeps the digits of small poses.
struct StreamTables {
  static constexpr int kBlock =
      128;  // frames per pass, so that y and r stay in the second-level cache
  int tets = 0;
  Eigen::MatrixXf rs_modes_transposed;  // Y^T, R x 9T, column c * T + t
  Eigen::MatrixXf map;                  // H, h x 9T, columns likewise
  Eigen::MatrixXf direct;               // D', h x R
  Eigen::MatrixXf base_rs_transposed;   // N x 9T, or empty
  Eigen::MatrixXf base_q;               // q', h x N, or empty

  StreamTables() = default;
  StreamTables(const ReducedModel& model, const BaseMotion* base);
};

struct StreamWorkspace {
  Eigen::MatrixXf z;  // R x kBlock
  Eigen::MatrixXf y;  // kBlock x 9T, overwritten by r

  /// q (h x n) of frames first .. first + n - 1.
  void evaluate(const StreamTables& tables, int first,
                const Eigen::Ref<const Eigen::MatrixXd>& all_z, Eigen::Ref<Eigen::MatrixXf> q);
};

}  // namespace limber::reduced
