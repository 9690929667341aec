#include "server/kinds/bodies/carried_surface.h"

#include "server/wire/arrays.h"

namespace limber::server {

std::shared_ptr<const CarriedSurface> carry_surface(const scene::Scene& scene) {
  if (!scene.surface) return nullptr;
  auto carried = std::make_shared<CarriedSurface>();
  carried->detailed = scene.surface;
  const auto& nodes = scene.mesh.nodes;
  carried->embedding =
      scene::embed_surface(nodes, scene.mesh.tets, scene.surface->surface.vertices);
  carried->body_length = (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).maxCoeff();
  return carried;
}

std::vector<std::string> remarks_on(const CarriedSurface& surface) {
  std::vector<std::string> remarks = surface.detailed->surface.warnings;
  std::string far = scene::embedding_warning(surface.embedding, surface.body_length);
  if (!far.empty()) remarks.push_back(std::move(far));
  return remarks;
}

proto::CarriedSurface encode_carried_surface(const CarriedSurface& surface) {
  proto::CarriedSurface message;
  message.set_name(surface.detailed->name);
  *message.mutable_vertices() = encode_points(surface.detailed->surface.vertices);
  *message.mutable_triangles() = encode_indices(surface.detailed->surface.triangles);
  *message.mutable_nodes() = encode_indices(surface.embedding.nodes);
  const Eigen::Matrix4Xf weights = surface.embedding.weights.cast<float>();
  auto& array = *message.mutable_weights();
  array.set_type(proto::DATA_TYPE_FLOAT32);
  array.add_shape(static_cast<std::uint64_t>(weights.cols()));
  array.add_shape(static_cast<std::uint64_t>(weights.rows()));
  array.set_data(weights.data(), static_cast<std::size_t>(weights.size()) * sizeof(float));
  message.set_outside_count(static_cast<std::uint32_t>(surface.embedding.outside_count));
  message.set_outside_distance(surface.embedding.outside_distance);
  return message;
}

std::uint64_t estimate_surface_bytes(const scene::DetailedSurface& surface) {
  constexpr std::uint64_t kBytesOfVertex = 24 + 16 + 32, kBytesOfTriangle = 12;
  std::uint64_t bytes = surface.content.size();
  for (const auto& [name, content] : surface.companions) bytes += content.size();
  return bytes + kBytesOfVertex * static_cast<std::uint64_t>(surface.surface.vertex_count()) +
         kBytesOfTriangle * static_cast<std::uint64_t>(surface.surface.triangle_count());
}

}  // namespace limber::server
