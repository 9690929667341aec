#pragma once

#include <array>
#include <functional>

#include "engine/bodies/elastic_body.h"
#include "engine/scene/scene.h"

namespace limber::bench::stability {

enum class Held { kNothing, kLeftFace };

/// A box of cells (six tets each), held at its face x = 0 or free, as the engine takes it from a
/// client's mesh. @throws Error as bodies::prepare_mesh
[[nodiscard]] bodies::ElasticBody box_body(std::array<int, 3> cells, const Eigen::Vector3d& size,
                                           Held held, const bodies::Material& material);

/// A body through the check of meshes again, after its nodes were moved. @throws as above
[[nodiscard]] bodies::ElasticBody prepared(bodies::ElasticBody body);

/// Tets whose centre satisfies `where` get a stiffness `contrast` times the first material's.
void stiffen(bodies::ElasticBody& body, double contrast,
             const std::function<bool(const Eigen::Vector3d&)>& where);

/// A node pushed into the opposite face of one of its tets, up to this share of its height.
void make_sliver(bodies::ElasticBody& body, double share);

/// The body as a scene of 40 frames with two targets for its far end.
/// @param reach  of the targets [body lengths]
[[nodiscard]] scene::Scene scene_of(const bodies::ElasticBody& body, double reach);

}  // namespace limber::bench::stability
