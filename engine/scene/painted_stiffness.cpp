#include "engine/scene/painted_stiffness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <unsupported/Eigen/BVH>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/index.h"

namespace limber::scene {
namespace {

void check(const std::vector<PaintedStiffness>& painted, Eigen::Index points) {
  if (static_cast<Eigen::Index>(painted.size()) != points) {
    throw Error(ErrorCode::kInvalidArgument, "values",
                std::to_string(painted.size()) + " values are given for " + std::to_string(points) +
                    " points");
  }
  for (std::size_t i = 0; i < painted.size(); ++i) {
    if (painted[i].value > 0 && std::isfinite(painted[i].value)) continue;
    const std::string field = "values[" + std::to_string(i) + "]";
    throw Error(ErrorCode::kInvalidArgument, field, field + " must be > 0 and finite");
  }
}

/// Meshes are validated later: with invalid indices or coordinates, this is skipped.
bool is_sound(const bodies::TetMesh& mesh) {
  return mesh.tet_count() > 0 && mesh.tets.minCoeff() >= 0 &&
         mesh.tets.maxCoeff() < mesh.node_count() && mesh.nodes.allFinite();
}

/// Natural logarithm of the modulus that a point gives to a tet of this material.
double log_modulus(const PaintedStiffness& painted, const bodies::Material& material) {
  const double value = std::log(painted.value);
  return painted.quantity == StiffnessQuantity::kYoungsModulus
             ? value
             : value + std::log(material.youngs_modulus);
}

/// @param logs  of each tet, the natural logarithm of its modulus
void set_moduli(Eigen::VectorXd logs, bodies::TetMesh& mesh) {
  const auto numbered = [&] {
    // In the order of the materials that they are made of, then of moduli.
    std::map<std::pair<int, double>, int> numbers;
    for (int tet = 0; tet < mesh.tet_count(); ++tet)
      numbers.emplace(std::pair(mesh.tet_material[index(tet)], logs(tet)), 0);
    return numbers;
  };
  auto numbers = numbered();
  if (numbers.size() > index(kMaxPaintedMaterials)) {
    const double least = logs.minCoeff();
    const double step = (logs.maxCoeff() - least) / (kMaxPaintedMaterials - 1);
    logs = ((logs.array() - least) / step).round() * step + least;
    numbers = numbered();
  }
  std::vector<bodies::Material> materials;
  for (auto& [key, number] : numbers) {
    number = static_cast<int>(materials.size());
    materials.push_back(mesh.materials[index(key.first)]);
    // Materials that no point changes keep their exact modulus.
    const double modulus = std::exp(key.second);
    if (std::abs(modulus / materials.back().youngs_modulus - 1) > 1e-12)
      materials.back().youngs_modulus = modulus;
  }
  for (int tet = 0; tet < mesh.tet_count(); ++tet)
    mesh.tet_material[index(tet)] = numbers.at({mesh.tet_material[index(tet)], logs(tet)});
  mesh.materials = std::move(materials);
}

void demand_materials(const bodies::Material& fallback, bodies::TetMesh& mesh) {
  if (!mesh.materials.empty()) return;
  mesh.materials = {fallback};
  mesh.tet_material.assign(index(mesh.tet_count()), 0);
}

/// Finds the nearest of many points.
class Points {
 public:
  explicit Points(const Eigen::Matrix3Xd& points) : points_(points) {
    std::vector<int> order(index(static_cast<int>(points.cols())));
    std::iota(order.begin(), order.end(), 0);
    std::vector<Eigen::AlignedBox3d> boxes;
    boxes.reserve(order.size());
    for (const int point : order) boxes.emplace_back(points.col(point));
    tree_.init(order.begin(), order.end(), boxes.begin(), boxes.end());
  }

  /// The nearest point; the first of several equally near ones.
  [[nodiscard]] int nearest(const Eigen::Vector3d& x) const {
    Search search{points_, x};
    Eigen::BVMinimize(tree_, search);
    return search.found;
  }

 private:
  struct Search {
    using Scalar = double;
    const Eigen::Matrix3Xd& points;
    Eigen::Vector3d x;
    int found = 0;
    double least = std::numeric_limits<double>::infinity();

    // Names that Eigen asks for.
    // NOLINTBEGIN(readability-identifier-naming)
    [[nodiscard]] double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
      return box.squaredExteriorDistance(x);
    }
    double minimumOnObject(int point) {
      const double distance = (points.col(point) - x).squaredNorm();
      if (distance < least || (distance == least && point < found)) {
        least = distance;
        found = point;
      }
      return distance;
    }
    // NOLINTEND(readability-identifier-naming)
  };

  const Eigen::Matrix3Xd& points_;
  Eigen::KdBVH<double, 3, int> tree_;
};

}  // namespace

void paint_nodes(const std::vector<PaintedStiffness>& nodes, const bodies::Material& fallback,
                 bodies::TetMesh& mesh) {
  check(nodes, mesh.nodes.cols());
  if (!is_sound(mesh)) return;
  demand_materials(fallback, mesh);
  Eigen::VectorXd logs(mesh.tet_count());
  for (int tet = 0; tet < mesh.tet_count(); ++tet) {
    double sum = 0;
    for (int corner = 0; corner < 4; ++corner)
      sum += log_modulus(nodes[index(mesh.tets(corner, tet))], mesh.material_of(tet));
    logs(tet) = sum / 4;
  }
  set_moduli(std::move(logs), mesh);
}

void paint_surface(const Eigen::Matrix3Xd& vertices, const std::vector<PaintedStiffness>& painted,
                   const bodies::Material& fallback, bodies::TetMesh& mesh) {
  check(painted, vertices.cols());
  if (!is_sound(mesh) || vertices.cols() == 0) return;
  demand_materials(fallback, mesh);
  const Points points(vertices);
  Eigen::VectorXd logs(mesh.tet_count());
  for (int tet = 0; tet < mesh.tet_count(); ++tet) {
    Eigen::Vector3d centre(0, 0, 0);
    for (int corner = 0; corner < 4; ++corner) centre += mesh.nodes.col(mesh.tets(corner, tet)) / 4;
    logs(tet) = log_modulus(painted[index(points.nearest(centre))], mesh.material_of(tet));
  }
  set_moduli(std::move(logs), mesh);
}

}  // namespace limber::scene
