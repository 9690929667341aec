#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>

#include "engine/scene/tetrahedralize/lattice.h"

namespace limber::scene::lattice {

/// Values of an implicit solid, and where its surface cuts edges.
class SurfaceCutter {
 public:
  /// @param tolerance  a cut is found when the surface is this near [length unit]
  SurfaceCutter(const ImplicitSolid& solid, double tolerance)
      : solid_(solid), tolerance_(tolerance * solid.lipschitz) {}

  /// @throws Error{kInvalidArgument} where the function is not finite
  [[nodiscard]] double value(const Eigen::Vector3d& x) const;

  /// Position of the surface on the edge from p (value fp) to q (fq, of the other sign), as a
  /// fraction from p. Found by regula falsi with the Illinois rule, so that kinks of a blended
  /// function cannot stall it.
  [[nodiscard]] double cut(const Eigen::Vector3d& p, double fp, const Eigen::Vector3d& q,
                           double fq) const;

 private:
  const ImplicitSolid& solid_;
  double tolerance_;
};

/// A corner of a lattice tet.
struct Corner {
  int point = 0;             // id of the lattice point
  double value = 0;          // negative inside, 0 on the surface
  Eigen::Vector3d rest;      // where the lattice has it
  Eigen::Vector3d position;  // where it was moved to, if it was
};

/// Turns lattice tets into output tets: the stencils of figure 3 of Labelle and Shewchuk.
class Stencils {
 public:
  explicit Stencils(const SurfaceCutter& cutter) : cutter_(cutter) {}

  void add(const std::array<Corner, 4>& corners);
  Stuffing take() { return std::move(result_); }

 private:
  void add_two_and_two(const Corner* inside, const Corner* outside);
  [[nodiscard]] const Eigen::Vector3d& at(int id) const {
    return result_.nodes[static_cast<std::size_t>(id)];
  }
  [[nodiscard]] double squared(int a, int b) const { return (at(a) - at(b)).squaredNorm(); }
  int add_node(const Eigen::Vector3d& x);
  int node(const Corner& corner);
  int cut(const Corner& inside, const Corner& outside);
  void emit(int a, int b, int c, int d);

  const SurfaceCutter& cutter_;
  Stuffing result_;
  std::unordered_map<int, int> points_;
  std::unordered_map<std::uint64_t, int> cuts_;
};

}  // namespace limber::scene::lattice
