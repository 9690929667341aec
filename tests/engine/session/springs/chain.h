#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/base/job.h"

// The example of docs/a-kind-of-your-own.md: a model and its solver, which know nothing of
// sessions.

namespace limber::session::springs {

using Shape = Eigen::Matrix3Xd;  // positions of nodes, a column each [m]

/// Between a node and the next: energy stiffness / 2 (length - rest_length)^2.
struct Spring {
  double stiffness = 1;    // [N/m], > 0
  double rest_length = 1;  // [m], > 0
};

/// What edits change.
struct Conditions {
  std::map<int, Eigen::Vector3d> pins;   // node to where it is held [m]
  std::map<int, Eigen::Vector3d> loads;  // node to force [N]
};

struct Chain {
  Shape nodes;                  // as drawn, at least 2
  std::vector<Spring> springs;  // springs[i] joins nodes i and i + 1
  Conditions conditions;        // as opened
};

/// @throws Error naming the field
void validate(const Chain& chain);
/// @throws Error{kOutOfRange, field}
void demand_node(const Chain& chain, int node, const char* field);
/// @throws Error{kInvalidArgument, field}
void demand_finite(const Eigen::Vector3d& vector, const char* field);

/// Of one shape. Degree of freedom 3 * node + axis.
struct Potential {
  double elastic = 0;        // of the springs [J]
  double work = 0;           // of the loads, from the origin [J]
  Eigen::VectorXd gradient;  // of value() [N]
  Eigen::MatrixXd hessian;   // of value(), as BandedCholesky reads it: (d, j) is H(j + d, j) [N/m]

  [[nodiscard]] double value() const { return elastic - work; }
};
[[nodiscard]] Potential potential(const Chain& chain, const Conditions& conditions,
                                  const Shape& shape);

enum class Status { kConverged, kCancelled, kFailed };
struct Report {
  Status status = Status::kFailed;
  int iterations = 0;
  double residual = 0;  // largest entry of the gradient at free nodes [N]
  double elastic = 0;   // [J]
  std::string message;
};
struct Equilibrium {
  Shape shape;
  Report report;
};

/// Newton's method with a line search, from this shape with its pinned nodes put in place.
/// Cancelled, the shape is the last iterate.
/// @throws Error{kNumerical} where a chain has loads and no pin
[[nodiscard]] Equilibrium find_equilibrium(const Chain& chain, const Conditions& conditions,
                                           Shape shape, const Cancellation& cancellation,
                                           const std::function<void(const Shape&)>& on_iterate);

}  // namespace limber::session::springs
