#pragma once

#include <optional>
#include <string>

#include "bench/suite.h"
#include "tests/support/material_bodies.h"

namespace limber::bench {

/// The body of a file; nothing, and a note of the suite, where the file is not there or the body
/// has more tets than --quick takes.
[[nodiscard]] std::optional<scene::Scene> public_body(const testing::BodyFile& file,
                                                      const std::string& suite, int most_quick_tets,
                                                      const SuiteOptions& options,
                                                      Recorder& recorder);

}  // namespace limber::bench
