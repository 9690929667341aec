#include "server/kinds/beams/memory_estimate.h"

#include <algorithm>
#include <cmath>

namespace limber::server {

std::uint64_t estimate_beam_bytes(const beams::BeamModel& model, int shapes) {
  return estimate_cut_beam_bytes(model, static_cast<int>(model.elements.size()), shapes);
}

std::uint64_t estimate_cut_beam_bytes(const beams::BeamModel& model, int elements, int shapes) {
  // A cut adds a node with each element.
  const auto m = static_cast<double>(elements);
  const double n =
      static_cast<double>(model.nodes.size()) + m - static_cast<double>(model.elements.size());
  double numbers = 36 * (n + 2 * m);                     // second derivatives, and as triplets
  numbers += 36 * n * 20 * std::log2(std::max(2.0, n));  // factor of a surface's under dissection
  numbers += n * 200 + m * 300;                          // states, kernels, the answer
  const double text = 24 * (13 * n + 17 * m) * 4;        // a number in .csv, and named in .json
  return static_cast<std::uint64_t>(numbers * sizeof(double) + text +
                                    shapes * 3 * n * 2 * sizeof(float));
}

}  // namespace limber::server
