#pragma once

#include "bench/suite.h"

namespace limber::bench {

/// Rows of the suite `spacetime` for the sample flower stretched over ever more frames, edited in a
/// session whose final results are of the reduced model or exact ones (Exactness). Values are
/// medians over the edits, each the move of one target. `first_ms`, `reduced_ms` and `final_ms`:
/// until its first result, the one with the reduced model's optimum in all frames, and the final
/// one (ResultHeader::since_edit_ms). `user_ms`: processor time with the check of the result.
/// `bytes_a_frame`: allocated after the edits, of the frames beyond the shortest motion's.
void run_long_scenes(const SuiteOptions& options, Recorder& recorder);

}  // namespace limber::bench
