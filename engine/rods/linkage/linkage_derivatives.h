#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

// First, second and third derivatives of a linkage's elastic energy by its unknowns, the rest
// lengths of its segments or edges and the scales of its sections together. Adjoints and Newton's
// method on designs use them. All come from one set of kernels on numbers, duals and duals of
// duals; nothing is assembled.

namespace limber::rods {

namespace detail {
struct ChainPoint;
}

/// A change of a linkage, or derivatives by one.
struct LinkageVector {
  Eigen::VectorXd unknowns;  // variables().size() numbers; empty in a direction: they stay
  /// For segments, from graph vertex to graph vertex [length]; empty in a direction: they stay.
  Eigen::VectorXd lengths;
  /// For edges by their EdgeNumbers [length], added to the part that follows from the segments;
  /// empty: zero.
  Eigen::VectorXd edges = {};
  /// For the scales of segments' sections; empty: zero.
  Eigen::VectorXd sections = {};
};

/// A shape as an increment of the unknowns of a state, rotations below pi; empty: that state.
struct LinkagePoint {
  const LinkageState& source;
  Eigen::VectorXd increment = {};
};

/// Derivatives D^k E of the elastic energy E(x, L), also by the rest lengths of edges and the
/// scales of sections. The increments x are counted from a point's source. L are the rest lengths
/// of segments, at the model's present ones and with the model's RestLengthMap. Exact at the source
/// and away from it (the finite transport's terms and those of the joints' rotations are in). At
/// the source, D^2 E by x is the matrix of LinkageAssembly.
///
/// Segments go four at a time and batches in parallel; results do not depend on the number of
/// threads.
class LinkageDerivatives {
 public:
  /// @pre the model outlives this; changes of its rest lengths are seen
  explicit LinkageDerivatives(const LinkageModel& model);

  /// dE/dx [force, or force length for angles], dE/dL [force], also by edges, and by sections
  /// [force length]. All four parts are given, as for second and third.
  [[nodiscard]] LinkageVector gradient(const LinkagePoint& at);
  /// D^2 E[v, .]: by unknowns H v_x + (dg/dL) v_L, by lengths (dg/dL)^T v_x + (d2E/dL2) v_L.
  [[nodiscard]] LinkageVector second(const LinkagePoint& at, const LinkageVector& v);
  /// D^3 E[v, w, .] + share * D^2 E[w, .]
  [[nodiscard]] LinkageVector third(const LinkagePoint& at, const LinkageVector& v,
                                    const LinkageVector& w, double share = 0);

  /// Second derivatives by all lengths at once, a product for each colour of the LengthPattern.
  struct ByLengths {
    Eigen::SparseMatrix<double> unknowns;  // dg/dL: variables().size() x segments
    Eigen::SparseMatrix<double> lengths;   // d2E/dL2: segments x segments
  };
  /// @throws Error{kCancelled} if the caller asks to stop
  [[nodiscard]] ByLengths by_lengths(const LinkagePoint& at, const JobContext& context = {});

 private:
  [[nodiscard]] LinkageVector evaluate(const LinkagePoint& at, int order, const LinkageVector* v,
                                       const LinkageVector* w, double share = 0);
  void evaluate_batch(const detail::ChainPoint& point, int batch, int order, LinkageVector& result);
  void gather(LinkageVector& result) const;

  const LinkageModel& model_;
  std::vector<std::vector<int>> ends_;                // of each joint: 2 segment + end
  std::vector<detail::LaneCell> rest_directions_[2];  // by slot
  std::vector<Eigen::Matrix<double, kJointUnknowns, 1>> by_joint_;  // 2 segment + end
  std::vector<Eigen::Vector3d> by_rest_;  // of each segment: terminal edges, free ones together
};

}  // namespace limber::rods
