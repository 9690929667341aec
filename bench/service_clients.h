#pragma once

#include <string>
#include <vector>

#include "bench/suite.h"

namespace limber::bench {

/// Clients, each with a session of its own that it edits at a steady rate, independent of the state
/// of earlier edits. Each reads its session's frames.
struct ServiceLoad {
  int clients = 1;
  double edits_per_s = 30;  // of each
  double seconds = 20;
  int builders = 0;  // clients besides that have one body after the other built
};
/// @param sample  scene of every session
/// @param options  of limberd
Case measure_clients(const SuiteOptions& options, Recorder& recorder, const ServiceLoad& load,
                     const std::string& sample, const std::vector<std::string>& server_options);

}  // namespace limber::bench
