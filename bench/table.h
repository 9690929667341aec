#pragma once

#include <string>
#include <vector>

#include "bench/suite.h"

namespace limber::bench {

/// Cases as an aligned table: consecutive cases with the same keys share a header. A table too wide
/// for a terminal is turned where that makes it narrower: a line per key, a column per case.
[[nodiscard]] std::string table_of(const std::vector<Case>& cases);

}  // namespace limber::bench
