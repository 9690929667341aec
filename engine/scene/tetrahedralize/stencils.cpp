#include "engine/scene/tetrahedralize/stencils.h"

#include <algorithm>
#include <cmath>

namespace limber::scene::lattice {

using Eigen::Vector3d;

double SurfaceCutter::value(const Vector3d& x) const {
  const double f = solid_.distance(x);
  if (!std::isfinite(f))
    throw Error(ErrorCode::kInvalidArgument, "", "the distance function is not finite");
  return f;
}

double SurfaceCutter::cut(const Vector3d& p, double fp, const Vector3d& q, double fq) const {
  double a = 0, b = 1, fa = fp, fb = fq;
  int side = 0;
  double t = fa / (fa - fb);
  for (int iteration = 0; iteration < 12; ++iteration) {
    const double f = value(p + t * (q - p));
    if (std::abs(f) < tolerance_) break;
    if ((f < 0) == (fa < 0)) {
      a = t;
      fa = f;
      if (side == 1) fb /= 2;
      side = 1;
    } else {
      b = t;
      fb = f;
      if (side == 2) fa /= 2;
      side = 2;
    }
    t = a + (b - a) * fa / (fa - fb);
  }
  return std::clamp(t, 1e-6, 1 - 1e-6);
}

void Stencils::add(const std::array<Corner, 4>& all) {
  Corner inside[4], outside[4], on[4];
  int in = 0, out = 0, zero = 0;
  for (const Corner& corner : all) {
    if (corner.value < 0) {
      // Quadrilaterals are shared with neighbours: their diagonal starts at the first inside corner
      // of one global order.
      int place = in++;
      for (; place > 0 && inside[place - 1].point > corner.point; --place) {
        inside[place] = inside[place - 1];
      }
      inside[place] = corner;
    } else if (corner.value > 0) {
      outside[out++] = corner;
    } else {
      on[zero++] = corner;
    }
  }
  if (in == 0) return;
  if (out == 0) {
    emit(node(all[0]), node(all[1]), node(all[2]), node(all[3]));
  } else if (in == 1) {
    int rest[3], n = 0;
    for (int i = 0; i < zero; ++i) rest[n++] = node(on[i]);
    for (int i = 0; i < out; ++i) rest[n++] = cut(inside[0], outside[i]);
    emit(node(inside[0]), rest[0], rest[1], rest[2]);
  } else if (in == 2 && out == 1) {
    const int a = node(inside[0]), b = node(inside[1]), z = node(on[0]);
    const int a_cut = cut(inside[0], outside[0]), b_cut = cut(inside[1], outside[0]);
    emit(a, b, b_cut, z);
    emit(a, b_cut, a_cut, z);
  } else if (in == 2) {
    add_two_and_two(inside, outside);
  } else {
    const int a = node(inside[0]), b = node(inside[1]), c = node(inside[2]);
    const int a_cut = cut(inside[0], outside[0]), b_cut = cut(inside[1], outside[0]);
    const int c_cut = cut(inside[2], outside[0]);
    emit(a, b, c, c_cut);
    emit(a, b, b_cut, c_cut);
    emit(a, a_cut, b_cut, c_cut);
  }
}

void Stencils::add_two_and_two(const Corner* inside, const Corner* outside) {
  const int a = node(inside[0]), b = node(inside[1]);
  const int a_n = cut(inside[0], outside[0]), a_m = cut(inside[0], outside[1]);
  const int b_n = cut(inside[1], outside[0]), b_m = cut(inside[1], outside[1]);
  emit(a, b, b_n, b_m);
  // The rest is a pyramid over the cut itself, which no neighbour shares: take the shorter
  // diagonal.
  if (squared(a_n, b_m) <= squared(a_m, b_n)) {
    emit(a, a_n, b_m, a_m);
    emit(a, a_n, b_m, b_n);
  } else {
    emit(a, a_m, b_n, a_n);
    emit(a, a_m, b_n, b_m);
  }
}

int Stencils::add_node(const Vector3d& x) {
  result_.nodes.push_back(x);
  return static_cast<int>(result_.nodes.size()) - 1;
}

int Stencils::node(const Corner& corner) {
  const auto [entry, is_new] = points_.try_emplace(corner.point, -1);
  if (is_new) entry->second = add_node(corner.position);
  return entry->second;
}

int Stencils::cut(const Corner& inside, const Corner& outside) {
  const std::uint64_t key =
      static_cast<std::uint64_t>(inside.point) << 32 | static_cast<std::uint32_t>(outside.point);
  const auto [entry, is_new] = cuts_.try_emplace(key, -1);
  if (is_new) {
    // Points next to a cut have not moved: moved ones are on the surface and cut nothing.
    const double t = cutter_.cut(inside.rest, inside.value, outside.rest, outside.value);
    entry->second = add_node(inside.rest + t * (outside.rest - inside.rest));
  }
  return entry->second;
}

void Stencils::emit(int a, int b, int c, int d) {
  const double volume = (at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a));
  result_.tets.emplace_back(a, b, volume >= 0 ? c : d, volume >= 0 ? d : c);
}

}  // namespace limber::scene::lattice
