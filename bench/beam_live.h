#pragma once

#include "bench/suite.h"
#include "engine/beams/model/beam_model.h"

namespace limber::bench {

enum class LiveEdits { kAll, kNear };

/// Opens a structure as a session does and moves its supports by 0.2 and 5 % of the extent. Adds to
/// a case `live_open_s` and, as medians over supports, `live_edit_ms`, `live_far_edit_ms`,
/// `live_snaps` and `live_far_snaps`. `live_failed` is the number of edits of both kinds that led
/// to no equilibrium.
void add_live_figures(const beams::BeamModel& model, int supports, LiveEdits which, Case& result);

}  // namespace limber::bench
