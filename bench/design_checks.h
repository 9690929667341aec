#pragma once

#include <Eigen/Core>
#include <string>

#include "bench/suite.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

/// Of J, of flatness and of the smallest angle: derivatives against differences of equilibria
/// solved again, as relative mismatches `gradient_check`, `hessvec_check`, `.._flatness` and
/// `.._angle`; null where no differences could be taken, or there is no derivative to compare with,
/// as of flatness where it is nothing. Where J has a crease (closest points change faces)
/// they are taken beside it, and `off_crease` says so.
/// @param v  along which
/// @param kind  ends the names of the results
void check_derivatives(rods::LinkageDesign& design, Eigen::VectorXd v, bool quick,
                       const std::string& kind, Case& result);

}  // namespace limber::bench
