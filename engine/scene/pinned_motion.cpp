#include "engine/scene/pinned_motion.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <set>

#include "engine/base/error.h"
#include "engine/base/rotations/polar.h"
#include "engine/scene/pose_rules.h"

namespace limber::scene {
namespace {

/// Pins whose spread across the line through them is less than this share of it give no rotation.
constexpr double kOnALine = 1e-6;
/// Share of the diagonal: parts of a mesh without pins follow rigidly.
constexpr double kHold = 1e-12;

struct RigidMotion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// Of least squares.
RigidMotion rigid_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d from_mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  const Eigen::Matrix3d spread =
      (to.colwise() - to_mean) * (from.colwise() - from_mean).transpose();
  const Eigen::Vector3d sizes = Eigen::JacobiSVD<Eigen::Matrix3d>(spread).singularValues();
  RigidMotion motion;
  if (sizes[1] > kOnALine * sizes[0])
    motion.turn = rotations::polar_decomposition(spread).rotation.toRotationMatrix();
  motion.shift = to_mean - motion.turn * from_mean;
  return motion;
}

/// Sums over the edges of (x_i - x_j)^2 / length^2: spreads what the pins do over the other nodes.
class Spreading {
 public:
  Spreading(const bodies::TetMesh& mesh, const std::vector<int>& pins)
      : place_(static_cast<std::size_t>(mesh.nodes.cols()), -1), pin_(place_) {
    for (std::size_t i = 0; i < pins.size(); ++i)
      pin_[static_cast<std::size_t>(pins[i])] = static_cast<int>(i);
    for (std::size_t node = 0; node < place_.size(); ++node)
      if (pin_[node] < 0) place_[node] = count_++;
    std::vector<Eigen::Triplet<double>> inner, outer;
    for (Eigen::Index tet = 0; tet < mesh.tets.cols(); ++tet)
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < a; ++b)
          add_edge(mesh, mesh.tets(a, tet), mesh.tets(b, tet), inner, outer);
    for (int i = 0; i < count_; ++i) inner.emplace_back(i, i, kHold);
    Eigen::SparseMatrix<double> system(count_, count_);
    system.setFromTriplets(inner.begin(), inner.end());
    to_pins_.resize(count_, static_cast<Eigen::Index>(pins.size()));
    to_pins_.setFromTriplets(outer.begin(), outer.end());
    factor_.compute(system);
    if (factor_.info() != Eigen::Success)
      throw Error(ErrorCode::kNumerical, "mesh", "the motion of the pins cannot be spread over it");
  }

  /// @param of_pins  3 x pins @returns 3 x nodes
  [[nodiscard]] Eigen::Matrix3Xd spread(const Eigen::Matrix3Xd& of_pins) const {
    const Eigen::MatrixX3d inner = factor_.solve(Eigen::MatrixX3d(to_pins_ * of_pins.transpose()));
    Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(place_.size()));
    for (std::size_t node = 0; node < place_.size(); ++node) {
      all.col(static_cast<Eigen::Index>(node)) =
          pin_[node] >= 0 ? Eigen::Vector3d(of_pins.col(pin_[node]))
                          : Eigen::Vector3d(inner.row(place_[node]).transpose());
    }
    return all;
  }

 private:
  void add_edge(const bodies::TetMesh& mesh, int a, int b,
                std::vector<Eigen::Triplet<double>>& inner,
                std::vector<Eigen::Triplet<double>>& outer) const {
    const double length2 = (mesh.nodes.col(a) - mesh.nodes.col(b)).squaredNorm();
    if (!(length2 > 0)) return;
    const double weight = 1 / length2;
    for (const auto& [one, other] : {std::pair{a, b}, {b, a}}) {
      const int row = place_[static_cast<std::size_t>(one)];
      if (row < 0) continue;
      inner.emplace_back(row, row, weight);
      const int column = place_[static_cast<std::size_t>(other)];
      if (column >= 0) {
        inner.emplace_back(row, column, -weight);
      } else {
        outer.emplace_back(row, pin_[static_cast<std::size_t>(other)], weight);
      }
    }
  }

  int count_ = 0;
  std::vector<int> place_, pin_;  // per node, or -1
  Eigen::SparseMatrix<double> to_pins_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace

Eigen::MatrixXd motion_of_pins(const bodies::TetMesh& mesh, const std::vector<int>& pins,
                               const Eigen::Ref<const Eigen::MatrixXd>& positions) {
  LIMBER_DEMAND(!pins.empty() && positions.rows() == 3 * static_cast<Eigen::Index>(pins.size()));
  const Spreading spreading(mesh, pins);
  const Eigen::Matrix3Xd rest = mesh.nodes(Eigen::all, pins);
  Eigen::MatrixXd motion(3 * mesh.nodes.cols(), positions.cols());
  for (Eigen::Index frame = 0; frame < positions.cols(); ++frame) {
    const Eigen::Matrix3Xd there = positions.col(frame).reshaped(3, rest.cols());
    const RigidMotion rigid = rigid_motion(rest, there);
    const auto carried = [&](const Eigen::Matrix3Xd& at) -> Eigen::Matrix3Xd {
      return (rigid.turn * at).colwise() + rigid.shift;
    };
    const Eigen::Matrix3Xd all =
        carried(mesh.nodes) + spreading.spread(there - carried(rest)) - mesh.nodes;
    motion.col(frame) = all.reshaped();
  }
  return motion;
}

std::optional<Issue> pins_fault(const Scene& scene,
                                const Eigen::Ref<const Eigen::MatrixXd>& positions) {
  constexpr double kMost = 2.5e8;
  const auto fault = [](std::string message, ErrorCode code = ErrorCode::kInvalidArgument) {
    return Issue{Issue::Severity::kError, "", std::move(message), code};
  };
  const std::vector<int>& pins = scene.fixed_nodes;
  if (pins.empty()) return fault("the scene has no fixed nodes to animate");
  if (std::set<int>(pins.begin(), pins.end()).size() != pins.size())
    return fault("the scene names a fixed node twice");
  if (positions.rows() != 3 * static_cast<Eigen::Index>(pins.size())) {
    return fault(fmt::format("has {} nodes, the scene has {} fixed nodes", positions.rows() / 3,
                             pins.size()));
  }
  if (positions.cols() != scene.frame_count) {
    return fault(
        fmt::format("has {} frames, the scene has {}", positions.cols(), scene.frame_count));
  }
  const int nodes = scene.mesh.node_count();
  if (3.0 * nodes * scene.frame_count > kMost) {
    return fault(fmt::format("makes a motion of {} frames of {} nodes; there may be {:g} numbers",
                             scene.frame_count, nodes, kMost),
                 ErrorCode::kLimitExceeded);
  }
  const double reach = reach_of_poses(scene);
  const Eigen::VectorXd rest = scene.mesh.nodes(Eigen::all, pins).reshaped();
  for (Eigen::Index frame = 0; frame < positions.cols(); ++frame) {
    auto wrong = pose_fault(positions.col(frame) - rest, reach);
    if (!wrong) continue;
    wrong->message += fmt::format(" in frame {}", frame);
    return wrong;
  }
  return std::nullopt;
}

Scene with_pins(Scene scene, const std::shared_ptr<const Eigen::MatrixXd>& positions) {
  if (positions) scene.base_motion = motion_of_pins(scene.mesh, scene.fixed_nodes, *positions);
  return scene;
}

}  // namespace limber::scene
