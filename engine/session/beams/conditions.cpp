#include "engine/session/beams/conditions.h"

namespace limber::session {

BeamConditions conditions_of(const beams::BeamModel& model) {
  return {model.supports, model.motions, model.loads, model.distributed_loads, model.gravity, {}};
}

beams::BeamModel with_conditions(beams::BeamModel model, const BeamConditions& conditions) {
  model.supports = conditions.supports;
  model.motions = conditions.motions;
  model.loads = conditions.loads;
  model.distributed_loads = conditions.distributed_loads;
  model.gravity = conditions.gravity;
  model.temporary_loads = conditions.temporary_loads;
  return model;
}

std::size_t bytes_of(const BeamConditions& conditions) {
  const auto of = [](const auto& items) {
    return items.size() * sizeof(typename std::decay_t<decltype(items)>::value_type);
  };
  return sizeof(BeamConditions) + of(conditions.supports) + of(conditions.motions) +
         of(conditions.loads) + of(conditions.distributed_loads) + of(conditions.temporary_loads);
}

}  // namespace limber::session
