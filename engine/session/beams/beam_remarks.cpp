#include "engine/session/beams/beam_remarks.h"

#include <algorithm>

namespace limber::session {

std::vector<scene::Issue> beam_remarks(const beams::BeamModel& model) {
  const bool has_weight =
      std::any_of(model.elements.begin(), model.elements.end(), [&](const beams::BeamElement& e) {
        return model.sections[static_cast<std::size_t>(e.section)].mass_per_length > 0;
      });
  if (has_weight || model.gravity.isZero(0)) return {};
  return {{scene::Issue::Severity::kWarning, "gravity",
           "gravity has no effect: no section of a beam has a density"}};
}

}  // namespace limber::session
