#pragma once

#include <algorithm>

#include "engine/scene/formats/mesh_formats.h"
#include "server/kinds/bodies/scene.h"
#include "server/runtime/options.h"

namespace limber::server {

/// Those that a scene of a body can exceed.
[[nodiscard]] inline SceneLimits scene_limits(const ServiceLimits& limits) {
  return {limits.mesh_tets, limits.frames, limits.constraints, limits.session_bytes};
}

/// Limits for the arrays of a mesh file: room for so many tets with as many nodes of their own, and
/// for cells that are no tets.
[[nodiscard]] inline scene::MeshReadLimits mesh_read_limits(const ServiceLimits& limits) {
  constexpr std::uint64_t kBytesOfTet = 1024, kMinBytes = 256ull << 20, kMaxBytes = 64ull << 30;
  const std::uint64_t most_tets = limits.mesh_tets, most_bytes = limits.session_bytes;
  const std::uint64_t tets =
      most_tets > 0 ? std::min(most_tets, kMaxBytes / kBytesOfTet) : kMaxBytes / kBytesOfTet;
  const std::uint64_t bytes = std::max(kBytesOfTet * tets, kMinBytes);
  return {static_cast<std::size_t>(most_bytes > 0 ? std::min(bytes, most_bytes) : bytes)};
}

}  // namespace limber::server
