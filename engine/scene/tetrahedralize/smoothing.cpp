#include "engine/scene/tetrahedralize/smoothing.h"

#include <algorithm>
#include <limits>

#include "engine/bodies/boundary_surface.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;

class Smoother {
 public:
  Smoother(Stuffing& stuffing, const ImplicitSolid& solid, std::vector<double> sizes)
      : s_(stuffing),
        solid_(solid),
        sizes_(std::move(sizes)),
        tets_of_(stuffing.nodes.size()),
        near_(stuffing.nodes.size()),
        on_surface_(stuffing.nodes.size(), 0) {
    bodies::TetNodes tets(4, static_cast<Eigen::Index>(s_.tets.size()));
    for (std::size_t t = 0; t < s_.tets.size(); ++t) {
      tets.col(static_cast<Eigen::Index>(t)) = s_.tets[t];
      for (int c = 0; c < 4; ++c) tets_of_[node(t, c)].push_back(t);
    }
    const bodies::SurfaceTriangles surface = bodies::boundary_surface(tets);
    for (const int id : surface.reshaped()) on_surface_[static_cast<std::size_t>(id)] = 1;
    // Surface nodes follow their neighbours on the surface only: the others would draw them inward.
    for (Eigen::Index t = 0; t < surface.cols(); ++t) {
      for (int e = 0; e < 3; ++e) {
        const auto a = static_cast<std::size_t>(surface(e, t)),
                   b = static_cast<std::size_t>(surface((e + 1) % 3, t));
        near_[a].push_back(b);  // each edge has two triangles, so b gets a from the other one
      }
    }
    for (std::size_t t = 0; t < s_.tets.size(); ++t) {
      for (int c = 0; c < 4; ++c) {
        if (on_surface_[node(t, c)]) continue;
        for (int o = 0; o < 4; ++o) {
          if (o != c) near_[node(t, c)].push_back(node(t, o));
        }
      }
    }
    for (auto& list : near_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }

  /// If the mean of the neighbours does not help, this tries 26 directions at three distances. It
  /// is for the few badly shaped tets of a lattice with cells of several sizes.
  /// @returns whether a node moved
  bool repair_pass(double good_enough, const JobContext& job) {
    std::vector<char> is_bad(s_.nodes.size(), 0);
    for (std::size_t t = 0; t < s_.tets.size(); ++t) {
      if (t % 256 == 0) job.throw_if_cancelled();
      if (shape_of(t) >= good_enough) continue;
      for (int c = 0; c < 4; ++c) is_bad[node(t, c)] = 1;
    }
    bool has_moved = false;
    for (std::size_t i = 0; i < s_.nodes.size(); ++i) {
      if (!is_bad[i]) continue;
      job.throw_if_cancelled();
      has_moved |= search_better_place(i, good_enough);
    }
    return has_moved;
  }

  void pass(double good_enough, const JobContext& job) {
    for (std::size_t i = 0; i < s_.nodes.size(); ++i) {
      if (i % 256 == 0) job.throw_if_cancelled();
      const double before = worst_around(i);
      if (before < good_enough) improve(i, before);
    }
  }

 private:
  [[nodiscard]] std::size_t node(std::size_t tet, int corner) const {
    return static_cast<std::size_t>(s_.tets[tet][corner]);
  }

  [[nodiscard]] double worst_around(std::size_t i) const {
    double worst = std::numeric_limits<double>::infinity();
    for (const std::size_t t : tets_of_[i]) {
      worst = std::min(worst, mean_ratio(s_.nodes[node(t, 0)], s_.nodes[node(t, 1)],
                                         s_.nodes[node(t, 2)], s_.nodes[node(t, 3)]));
    }
    return worst;
  }

  [[nodiscard]] double shape_of(std::size_t t) const {
    return tet_shape(s_.nodes[node(t, 0)], s_.nodes[node(t, 1)], s_.nodes[node(t, 2)],
                     s_.nodes[node(t, 3)]);
  }
  [[nodiscard]] double worst_shape_around(std::size_t i) const {
    double worst = std::numeric_limits<double>::infinity();
    for (const std::size_t t : tets_of_[i]) worst = std::min(worst, shape_of(t));
    return worst;
  }

  bool search_better_place(std::size_t i, double good_enough) {
    double best = worst_shape_around(i);
    bool has_moved = false;
    for (const double step : {0.2, 0.1, 0.05, 0.025}) {
      for (int d = 0; d < 27 && best < good_enough; ++d) {
        if (d == 13) continue;
        const Vector3d old = s_.nodes[i];
        const Vector3d direction = Vector3d(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1).normalized();
        Vector3d place = old + step * sizes_[i] * direction;
        if (on_surface_[i] && !project_to_surface(solid_, sizes_[i], place)) continue;
        s_.nodes[i] = place;
        const double now = worst_shape_around(i);
        if (now > best) {
          best = now;
          has_moved = true;
        } else {
          s_.nodes[i] = old;
        }
      }
    }
    return has_moved;
  }

  void improve(std::size_t i, double before) {
    const Vector3d old = s_.nodes[i];
    Vector3d mean = Vector3d::Zero();
    for (const std::size_t n : near_[i]) mean += s_.nodes[n];
    mean /= static_cast<double>(near_[i].size());
    for (const double step : {1.0, 0.5, 0.25}) {
      Vector3d place = old + step * (mean - old);
      if (on_surface_[i] && !project_to_surface(solid_, sizes_[i], place)) continue;
      s_.nodes[i] = place;
      if (worst_around(i) > before) return;
    }
    s_.nodes[i] = old;
  }

  Stuffing& s_;
  const ImplicitSolid& solid_;
  std::vector<double> sizes_;
  std::vector<std::vector<std::size_t>> tets_of_, near_;
  std::vector<char> on_surface_;
};

}  // namespace

bool project_to_surface(const ImplicitSolid& solid, double size, Vector3d& x) {
  const double h = 1e-4 * size;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const double f = solid.distance(x);
    if (std::abs(f) < 1e-3 * size * solid.lipschitz) return true;
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d d = h * Vector3d::Unit(axis);
      gradient[axis] = (solid.distance(x + d) - solid.distance(x - d)) / (2 * h);
    }
    const double square = gradient.squaredNorm();
    if (!(square > 1e-6)) return false;
    const Vector3d move = -f / square * gradient;
    if (move.norm() > 0.5 * size) return false;
    x += move;
  }
  return std::abs(solid.distance(x)) < 1e-2 * size * solid.lipschitz;
}

void smooth(Stuffing& stuffing, const ImplicitSolid& solid, double cell, int passes,
            const JobContext& job, double good_enough) {
  if (passes <= 0 || stuffing.tets.empty()) return;
  Smoother smoother(stuffing, solid, std::vector<double>(stuffing.nodes.size(), cell));
  for (int pass = 0; pass < passes; ++pass) {
    job.report("smoothing the mesh", static_cast<double>(pass) / passes);
    smoother.pass(good_enough, job);
  }
}

void smooth_graded(Stuffing& stuffing, const ImplicitSolid& solid, int passes,
                   const JobContext& job) {
  constexpr double kGoodEnough = 0.7;
  constexpr double kGoodShape = 1.2;
  constexpr int kMaxRepairPasses = 12;
  if (passes <= 0 || stuffing.tets.empty()) return;
  // Cells differ: the size at a node is its shortest edge, which in a uniform lattice is a centre's
  // edge to a corner.
  std::vector<double> sizes(stuffing.nodes.size(), std::numeric_limits<double>::infinity());
  for (const Eigen::Vector4i& tet : stuffing.tets) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        const auto i = static_cast<std::size_t>(tet[a]), j = static_cast<std::size_t>(tet[b]);
        if (i != j) sizes[i] = std::min(sizes[i], (stuffing.nodes[i] - stuffing.nodes[j]).norm());
      }
    }
  }
  Smoother smoother(stuffing, solid, std::move(sizes));
  for (int pass = 0; pass < passes; ++pass) {
    job.report("smoothing the mesh", 0.5 * pass / passes);
    smoother.pass(kGoodEnough, job);
  }
  for (int pass = 0; pass < kMaxRepairPasses; ++pass) {
    job.report("smoothing the mesh", 0.5 + 0.5 * pass / kMaxRepairPasses);
    if (!smoother.repair_pass(kGoodShape, job)) break;
  }
}

}  // namespace limber::scene::lattice
