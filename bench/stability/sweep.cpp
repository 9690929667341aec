#include "bench/stability/sweep.h"

#include <cmath>
#include <cstdlib>

namespace limber::bench::stability {

std::vector<double> decades(int first, int last, int step) {
  std::vector<double> values;
  for (int exponent = first; step > 0 ? exponent <= last : exponent >= last; exponent += step)
    values.push_back(std::pow(10.0, exponent));
  return values;
}

bool wants_faults() { return std::getenv("LIMBER_STABILITY_FAULTS") != nullptr; }

}  // namespace limber::bench::stability
