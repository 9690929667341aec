#pragma once

#include "engine/rods/linkage/linkage_model.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods::testing {

inline constexpr RodStiffness kStiffness{50, 2.0, 0.7, 0.9};

/// Joints with one and two rods, free ends, and a rod alone.
inline LinkageModel mixed_model() { return {build_linkage_graph(mixed_mesh()), 5, kStiffness}; }

}  // namespace limber::rods::testing
