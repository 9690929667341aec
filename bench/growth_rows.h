#pragma once

#include <string>

#include "bench/suite.h"

namespace limber::bench {

/// Keys of every row of growth; a suite may add keys of its own.
/// @param growth  the parameter that grows, `size` its value
[[nodiscard]] inline Case growth_row(const std::string& growth, double size,
                                     const std::string& what, double ms, int not_converged = 0) {
  Case row;
  row["growth"] = growth;
  row["size"] = size;
  row["what"] = what;
  row["ms"] = ms;
  row["not_converged"] = not_converged;
  return row;
}

}  // namespace limber::bench
