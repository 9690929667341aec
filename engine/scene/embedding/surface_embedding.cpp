#include "engine/scene/embedding/surface_embedding.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/BVH>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/scene/tetrahedralize/point_triangle.h"

namespace limber::scene {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;
using TetTree = Eigen::KdBVH<double, 3, int>;

/// Surfaces farther from the tets than this share of the body's length are worth a warning.
constexpr double kFar = 0.05;
/// Distances below this share of the mesh's extent are rounding.
constexpr double kRounding = 1e-12;
constexpr int kVerticesAtOnce = 256;

}  // namespace

class Embedder::Tets {
 public:
  Tets(const Eigen::Matrix3Xd& nodes, const bodies::TetNodes& tets) : nodes_(nodes), tets_(tets) {
    std::vector<int> order(static_cast<std::size_t>(tets.cols()));
    std::iota(order.begin(), order.end(), 0);
    std::vector<Eigen::AlignedBox3d> boxes(order.size());
    for (const int t : order) {
      for (int corner = 0; corner < 4; ++corner)
        boxes[static_cast<std::size_t>(t)].extend(node(t, corner));
    }
    tree_.init(order.begin(), order.end(), boxes.begin(), boxes.end());
  }

  struct Nearest {
    int tet = -1;
    double squared_distance = std::numeric_limits<double>::infinity();
  };
  [[nodiscard]] Nearest nearest(const Vector3d& x) const {
    Search search{*this, x, {}};
    Eigen::BVMinimize(tree_, search);
    return search.found;
  }

  [[nodiscard]] Eigen::Vector4i corners(int tet) const { return tets_.col(tet); }

  /// Barycentric coordinates of x.
  [[nodiscard]] Vector4d weights(int tet, const Vector3d& x) const {
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = node(tet, k + 1) - node(tet, 0);
    const Vector3d beyond_first = edges.partialPivLu().solve(x - node(tet, 0));
    Vector4d weights;
    weights << 1 - beyond_first.sum(), beyond_first;
    return weights;
  }

 private:
  /// As Eigen::BVMinimize wants it.
  struct Search {
    using Scalar = double;
    const Tets& tets;
    const Vector3d& x;
    Nearest found;

    double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
      return box.squaredExteriorDistance(x);
    }
    double minimumOnObject(int tet) {
      const double distance = tets.squared_distance(tet, x);
      if (distance < found.squared_distance ||
          (distance == found.squared_distance && tet < found.tet))
        found = {tet, distance};
      return distance;
    }
  };

  [[nodiscard]] Vector3d node(int tet, int corner) const { return nodes_.col(tets_(corner, tet)); }
  /// 0 within the tet.
  [[nodiscard]] double squared_distance(int tet, const Vector3d& x) const {
    if (weights(tet, x).minCoeff() >= 0) return 0;
    double least = std::numeric_limits<double>::infinity();
    for (int left_out = 0; left_out < 4; ++left_out) {
      least = std::min(least, lattice::squared_distance(x, node(tet, (left_out + 1) % 4),
                                                        node(tet, (left_out + 2) % 4),
                                                        node(tet, (left_out + 3) % 4)));
    }
    return least;
  }

  const Eigen::Matrix3Xd& nodes_;
  const bodies::TetNodes& tets_;
  TetTree tree_;
};

Embedder::Embedder(const Eigen::Matrix3Xd& nodes, const bodies::TetNodes& tets)
    : tets_(std::make_unique<const Tets>(nodes, tets)) {}
Embedder::~Embedder() = default;

Embedder::Place Embedder::place(const Vector3d& point) const {
  const Tets::Nearest nearest = tets_->nearest(point);
  return {tets_->corners(nearest.tet), tets_->weights(nearest.tet, point),
          std::sqrt(nearest.squared_distance)};
}

SurfaceEmbedding embed_surface(const Eigen::Matrix3Xd& nodes, const bodies::TetNodes& tets,
                               const Eigen::Matrix3Xd& vertices) {
  const Embedder mesh(nodes, tets);
  SurfaceEmbedding embedding;
  embedding.nodes.resize(4, vertices.cols());
  embedding.weights.resize(4, vertices.cols());
  Eigen::VectorXd distances(vertices.cols());
  parallel_for(vertices.cols(), kVerticesAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t v = begin; v < end; ++v) {
      const Embedder::Place place = mesh.place(vertices.col(v));
      embedding.nodes.col(v) = place.nodes;
      embedding.weights.col(v) = place.weights;
      distances(v) = place.distance;
    }
  });
  const double extent = (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).norm();
  // Far from the origin, coordinates themselves are rounded more than that.
  const double digits = 4 * std::numeric_limits<double>::epsilon() * nodes.cwiseAbs().maxCoeff();
  const auto is_outside = distances.array() > std::max(kRounding * extent, digits);
  embedding.outside_count = static_cast<int>(is_outside.count());
  if (embedding.outside_count > 0) embedding.outside_distance = distances.maxCoeff();
  return embedding;
}

Eigen::MatrixXd embedded_positions(const SurfaceEmbedding& embedding,
                                   const Eigen::Ref<const Eigen::MatrixXd>& positions) {
  Eigen::MatrixXd moved(3 * embedding.nodes.cols(), positions.cols());
  parallel_for(positions.cols(), 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t frame = begin; frame < end; ++frame) {
      const auto column = positions.col(frame);
      for (Eigen::Index v = 0; v < embedding.nodes.cols(); ++v) {
        Vector3d x = Vector3d::Zero();
        for (int corner = 0; corner < 4; ++corner) {
          x += embedding.weights(corner, v) *
               column.segment<3>(3 * Eigen::Index{embedding.nodes(corner, v)});
        }
        moved.col(frame).segment<3>(3 * v) = x;
      }
    }
  });
  return moved;
}

std::string embedding_warning(const SurfaceEmbedding& embedding, double body_length) {
  if (!(embedding.outside_distance > kFar * body_length)) return {};
  return fmt::format(
      "{} of its {} vertices lie outside the mesh, the farthest by {:.2g} % of the body's length: "
      "they follow the nearest tet",
      embedding.outside_count, embedding.vertex_count(),
      100 * embedding.outside_distance / body_length);
}

}  // namespace limber::scene
