#pragma once

#include "bench/suite.h"
#include "engine/beams/model/beam_model.h"

namespace limber::bench {

enum class LiveEdits { kAll, kNear };

/// Opens a structure as a session does and moves its supports: adds to a case `live_open_s`, and
/// for displacements of 0.2 and 5 % of the extent (medians over supports) `live_edit_ms`,
/// `live_far_edit_ms`, `live_snaps`, `live_far_snaps` and `live_failed`, the edits of both kinds
/// that led to no equilibrium. kNear leaves out the far ones.
void add_live_figures(const beams::BeamModel& model, int supports, LiveEdits which, Case& result);

}  // namespace limber::bench
