#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/scene/embedding/surface_embedding.h"
#include "engine/scene/scene.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The surface of a scene and where its vertices are in the mesh: immutable, shared between
/// threads.
struct CarriedSurface {
  std::shared_ptr<const scene::DetailedSurface> detailed;
  scene::SurfaceEmbedding embedding;
  double body_length = 0;  // longest side of the box around the mesh [scene length unit]

  [[nodiscard]] int vertex_count() const { return embedding.vertex_count(); }
};

inline constexpr const char* kNoSurface =
    "the scene names no surface: `surface` is its field for one";

/// Null for a scene without a surface.
[[nodiscard]] std::shared_ptr<const CarriedSurface> carry_surface(const scene::Scene& scene);

/// Its reader's remarks on the file and on its position.
[[nodiscard]] std::vector<std::string> remarks_on(const CarriedSurface& surface);

[[nodiscard]] proto::CarriedSurface encode_carried_surface(const CarriedSurface& surface);

/// Memory that one takes [bytes].
[[nodiscard]] std::uint64_t estimate_surface_bytes(const scene::DetailedSurface& surface);

}  // namespace limber::server
