#pragma once

#include <cstdint>

#include "engine/scene/scene.h"

namespace limber::server {

/// Peak memory of building and keeping a session [bytes], from its sizes alone and rather too high:
/// poses of the training (hundreds of columns of 3n), modes, basis, stiffness and its factor,
/// per-tet operators, base motion, kept results.
[[nodiscard]] std::uint64_t estimate_session_bytes(const scene::Scene& scene);

}  // namespace limber::server
