#include "server/kinds/bodies/geometry.h"

#include "server/kinds/bodies/scene.h"
#include "server/wire/arrays.h"
#include "server/wire/issues.h"

namespace limber::server {

proto::GetGeometryResponse encode_geometry(const session::Geometry& geometry,
                                           const std::string& known_basis_hash) {
  proto::GetGeometryResponse response;
  *response.mutable_rest() = encode_points(geometry.rest);
  *response.mutable_tets() = encode_indices(geometry.tets);
  *response.mutable_surface() = encode_indices(geometry.surface);
  response.set_basis_hash(geometry.basis_hash);
  if (known_basis_hash.empty() || known_basis_hash != geometry.basis_hash) {
    const bool is_known = !known_basis_hash.empty() && known_basis_hash == geometry.extended_hash;
    const Eigen::Index known = is_known ? geometry.extended_columns : 0;
    response.set_known_columns(static_cast<std::uint32_t>(known));
    const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows =
        geometry.basis.rightCols(geometry.basis.cols() - known);
    auto* basis = response.mutable_basis();
    basis->set_type(proto::DATA_TYPE_FLOAT32);
    basis->add_shape(static_cast<std::uint64_t>(rows.rows() / 3));
    basis->add_shape(3);
    basis->add_shape(static_cast<std::uint64_t>(rows.cols()));
    basis->set_data(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(float));
  }
  for (const auto& text : geometry.repairs) *response.add_issues() = encode_warning("mesh", text);
  for (const auto& text : geometry.warnings) *response.add_issues() = encode_warning("mesh", text);
  return response;
}

}  // namespace limber::server
