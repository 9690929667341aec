#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/modal_analysis.h"

namespace limber::bodies {

/// Two columns of ModalBasis::modes, in either order.
struct ModePair {
  int first = 0, second = 0;
};

/// d K(u)/du [p] q at u = 0, 3n [N], for the StVK forces K(u) u: the second derivative of
/// StvkEnergy::gradient along p and q (3n each [m]). Symmetric in p and q.
[[nodiscard]] Eigen::VectorXd second_force_derivative(const ElasticBody& body,
                                                      const Eigen::Ref<const Eigen::VectorXd>& p,
                                                      const Eigen::Ref<const Eigen::VectorXd>& q);

/// Modal derivatives at rest (Barbic and James 2005, eq. 13; space-time editing, section 3.1).
///   K Phi_ij = -(d K(u)/du [phi_i]) phi_j,
/// They are the quadratic part of the path along which static loads M phi_k deform the body. StVK;
/// symmetric in i and j. Fixed nodes have zero rows. For a free body, and with mechanisms, K is
/// singular: the load is made self-equilibrated and the part of Phi_ij along those modes is left
/// out. For a rigid rotation i of a free body, Phi_ij is the turned mode j, to the order of
/// lambda_j. Pairs of two rigid modes give rigid motions' second order, which affine fields span.
/// @param basis  of this body, elastic columns mass-orthonormal as modal_analysis gives them
/// @return 3n x pairs.size() [1/kg, as phi_i phi_j / m]
/// @throws Error{kNumerical} if K cannot be factored in double precision, Error{kCancelled}
[[nodiscard]] Eigen::MatrixXd modal_derivatives(const ElasticBody& body, const ModalBasis& basis,
                                                const std::vector<ModePair>& pairs,
                                                const JobContext& job = {});

}  // namespace limber::bodies
