#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "engine/bodies/tet_mesh.h"

namespace limber::scene {

/// Positions of a surface's vertices within a tetrahedral mesh. Each is a mean of the corners of
/// one tet, weighted by its barycentric coordinates at rest. As the nodes move, the surface
/// follows.
struct SurfaceEmbedding {
  Eigen::Matrix<int, 4, Eigen::Dynamic> nodes;  // 4 x v: corners of the vertex's tet
  Eigen::Matrix4Xd weights;                     // 4 x v, each column's sum is 1
  /// Vertices in no tet follow the nearest one, with weights beyond [0, 1].
  int outside_count = 0;
  double outside_distance = 0;  // largest distance of one from the tets [length of the nodes]

  [[nodiscard]] int vertex_count() const { return static_cast<int>(nodes.cols()); }
};

/// Finds the tets that single points hang on.
class Embedder {
 public:
  /// Both outlive this. @param nodes  3 x n
  /// @param tets  of volume, >= 1; of either orientation
  Embedder(const Eigen::Matrix3Xd& nodes, const bodies::TetNodes& tets);
  ~Embedder();

  struct Place {
    Eigen::Vector4i nodes;
    Eigen::Vector4d weights;
    double distance = 0;  // of the point from the tets
  };
  /// Thread-safe; the same as a column of embed_surface().
  [[nodiscard]] Place place(const Eigen::Vector3d& point) const;

 private:
  class Tets;
  std::unique_ptr<const Tets> tets_;
};

/// Rest positions are met in every vertex, inside the mesh or not, to rounding.
/// @param nodes  3 x n
/// @param tets  of volume, >= 1; of either orientation
/// @param vertices  3 x v, in the same unit
[[nodiscard]] SurfaceEmbedding embed_surface(const Eigen::Matrix3Xd& nodes,
                                             const bodies::TetNodes& tets,
                                             const Eigen::Matrix3Xd& vertices);

/// Vertices of moved nodes.
/// @param positions  3n x frames, x y z of each node in turn
/// @returns 3v x frames
[[nodiscard]] Eigen::MatrixXd embedded_positions(
    const SurfaceEmbedding& embedding, const Eigen::Ref<const Eigen::MatrixXd>& positions);

/// Warning for a surface outside the body that is to carry it; empty if the surface is near it.
/// @param body_length  longest side of the box around the nodes, in the unit of the nodes
[[nodiscard]] std::string embedding_warning(const SurfaceEmbedding& embedding, double body_length);

}  // namespace limber::scene
