#include "server/kinds/beams/memory_estimate.h"

#include <algorithm>
#include <cmath>

namespace limber::server {

std::uint64_t estimate_beam_bytes(const beams::BeamModel& model, int shapes, int stations) {
  return estimate_cut_beam_bytes(model, static_cast<int>(model.elements.size()), shapes, stations);
}

std::uint64_t estimate_cut_beam_bytes(const beams::BeamModel& model, int elements, int shapes,
                                      int stations) {
  // A cut adds a node with each element.
  const auto m = static_cast<double>(elements);
  const double n =
      static_cast<double>(model.nodes.size()) + m - static_cast<double>(model.elements.size());
  double numbers = 36 * (n + 2 * m);                     // second derivatives, and as triplets
  numbers += 36 * n * 20 * std::log2(std::max(2.0, n));  // factor of a surface's under dissection
  numbers += n * 200 + m * (400 + 8 * stations);         // states, kernels, the answer
  // A node takes 7 numbers in a session's shape (position and rotation); in a solve, its stored
  // position and the answer for distant structures take 6.
  numbers += shapes * 7 * n;
  // A number in .csv, and named in .json.
  const double text = 24 * (13 * n + (42 + 10 * stations) * m) * 4;
  return static_cast<std::uint64_t>(numbers * sizeof(double) + text);
}

}  // namespace limber::server
