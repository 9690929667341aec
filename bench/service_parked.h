#pragma once

#include "bench/suite.h"

namespace limber::bench {

/// So many small bodies, each opened and edited once, then left alone until all of them rest in the
/// store: what the server takes then, and how long one is until an answer about it, and its frames,
/// are there.
Case measure_parked(const SuiteOptions& options, Recorder& recorder, int sessions);

}  // namespace limber::bench
