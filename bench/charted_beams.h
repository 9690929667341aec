#pragma once

#include <Eigen/Core>
#include <string>

#include "bench/suite.h"
#include "engine/beams/model/beam_model.h"

namespace limber::bench {

/// Rows of known answers as the paper's relaxation in its chart of the normal gives them, with the
/// keys of the others. If it reports balance, all errors are listed.
void run_charted_answers(const SuiteOptions& options, Recorder& recorder);

/// A public structure by the paper's relaxation and by ours of the same element, timed: the
/// baseline and its factor.
/// @param places  positions of the nodes that the public code reached
void run_charted_structure(const std::string& name, beams::BeamModel model,
                           const Eigen::Matrix3Xd& places, const SuiteOptions& options,
                           Recorder& recorder);

}  // namespace limber::bench
