#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/session/bodies/changes.h"
#include "engine/session/bodies/document.h"

namespace limber::session {

/// The changes that bring a solver to the document's present state: values, no longer tied to the
/// document.
struct EditBatch {
  std::vector<std::uint64_t> removed;  // those the solver does not know are skipped
  std::vector<scene::Constraint> set;  // added or replaced
  std::vector<TargetChange> moved;
  std::optional<EndsChange> ends;
  std::optional<scene::Dynamics> dynamics;
  std::optional<MaterialChange> material;
  std::optional<PinPaths> pins;
  std::optional<std::vector<scene::Keyframe>> keyframes;  // all of them, where any has changed
};

/// The newest state of the touched objects.
[[nodiscard]] EditBatch batch_of(const Document& document, const Touched& touched);

/// Everything, for a new solver.
[[nodiscard]] EditBatch whole_batch(const Document& document);

}  // namespace limber::session
