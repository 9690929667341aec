#include "engine/scene/tetrahedralize/smoothing.h"

#include <algorithm>
#include <limits>

#include "engine/bodies/boundary_surface.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;

class Smoother {
 public:
  Smoother(Stuffing& stuffing, const ImplicitSolid& solid, double cell)
      : s_(stuffing),
        solid_(solid),
        cell_(cell),
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

  void improve(std::size_t i, double before) {
    const Vector3d old = s_.nodes[i];
    Vector3d mean = Vector3d::Zero();
    for (const std::size_t n : near_[i]) mean += s_.nodes[n];
    mean /= static_cast<double>(near_[i].size());
    for (const double step : {1.0, 0.5, 0.25}) {
      Vector3d place = old + step * (mean - old);
      if (on_surface_[i] && !project(place)) continue;
      s_.nodes[i] = place;
      if (worst_around(i) > before) return;
    }
    s_.nodes[i] = old;
  }

  /// Newton along the gradient (central differences) onto the surface.
  bool project(Vector3d& x) const {
    const double h = 1e-4 * cell_;
    for (int iteration = 0; iteration < 3; ++iteration) {
      const double f = solid_.distance(x);
      if (std::abs(f) < 1e-3 * cell_ * solid_.lipschitz) return true;
      Vector3d gradient;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d d = h * Vector3d::Unit(axis);
        gradient[axis] = (solid_.distance(x + d) - solid_.distance(x - d)) / (2 * h);
      }
      const double square = gradient.squaredNorm();
      if (!(square > 1e-6)) return false;
      const Vector3d move = -f / square * gradient;
      if (move.norm() > 0.5 * cell_) return false;
      x += move;
    }
    return std::abs(solid_.distance(x)) < 1e-2 * cell_ * solid_.lipschitz;
  }

  Stuffing& s_;
  const ImplicitSolid& solid_;
  double cell_;
  std::vector<std::vector<std::size_t>> tets_of_, near_;
  std::vector<char> on_surface_;
};

}  // namespace

void smooth(Stuffing& stuffing, const ImplicitSolid& solid, double cell, int passes,
            const JobContext& job, double good_enough) {
  if (passes <= 0 || stuffing.tets.empty()) return;
  Smoother smoother(stuffing, solid, cell);
  for (int pass = 0; pass < passes; ++pass) {
    job.report("smoothing the mesh", static_cast<double>(pass) / passes);
    smoother.pass(good_enough, job);
  }
}

}  // namespace limber::scene::lattice
