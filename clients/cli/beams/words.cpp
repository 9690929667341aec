#include "clients/cli/beams/words.h"

#include <fmt/format.h>

namespace limber::cli::beams {

std::string inertia_words(unsigned negative_eigenvalues) {
  if (negative_eigenvalues == 0) return "";
  return fmt::format(" ({} negative eigenvalue{})", negative_eigenvalues,
                     negative_eigenvalues == 1 ? "" : "s");
}

std::string snap_words(const v1::BeamSnap& snap) {
  return fmt::format("at {:.3f} of the way: node {} turns by {:.3g} rad", snap.progress(),
                     snap.node(), snap.turn());
}

}  // namespace limber::cli::beams
