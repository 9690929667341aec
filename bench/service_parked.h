#pragma once

#include "bench/suite.h"

namespace limber::bench {

/// Small bodies, each opened and edited once, then left alone until all of them rest in the store.
/// Measures the server's memory then, and the time until an answer about one, and its frames, are
/// there.
Case measure_parked(const SuiteOptions& options, Recorder& recorder, int sessions);

}  // namespace limber::bench
