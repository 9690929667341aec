#pragma once

#include <Eigen/Core>
#include <string>

#include "bench/suite.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

/// Derivatives of J, of flatness and of the smallest angle against differences of equilibria solved
/// again. Results are relative mismatches `gradient_check`, `hessvec_check`, `.._flatness` and
/// `.._angle`. They are null if no differences could be taken, or if there is no derivative to
/// compare with, as of flatness when it is zero. If J has a crease (closest points change faces),
/// they are taken next to it, and `off_crease` says so.
/// @param v  along which
/// @param kind  ends the names of the results
void check_derivatives(rods::LinkageDesign& design, Eigen::VectorXd v, bool quick,
                       const std::string& kind, Case& result);

}  // namespace limber::bench
