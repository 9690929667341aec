#include "bench/rod_kernels.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/base/parallel.h"
#include "engine/rods/rod/stretch_element.h"
#include "tests/support/rod_derivatives.h"

namespace limber::bench {

namespace {

using rods::BendingForm;
using rods::Lane;
using rods::MaterialFrame;
using rods::RodAtSource;
using rods::RodLayout;
using rods::RodParameters;
using rods::RodState;
using rods::SourceFrames;
using rods::VertexMaterial;

double nanoseconds(int repeats, auto&& work) {
  double best = 1e300;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(
        best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return 1e9 * best;
}

/// Two bent, twisted edges, different in every lane and every call.
template <class V>
struct Element {
  MaterialFrame<V> before;
  MaterialFrame<V> after;
  VertexMaterial<V> material;
};
template <class V>
Element<V> element(const V& disturbance) {
  const Vec3<V> x0{0.0, 0.0, 0.0}, x1{1.0, 0.1, disturbance}, x2{2.0, disturbance, 0.3};
  const Vec3<V> along{1.0, 0.0, 0.0}, across{0.0, 1.0, 0.0};
  const V one(1.0);
  return {rods::material_frame<V>(x0, x1, V(0.2), along, across),
          rods::material_frame<V>(x1, x2, V(0.4) + disturbance, along, across),
          {V(2.0), V(0.5), V(0.8), length_weights(one, one, BendingForm::kMaterialFrames), {}}};
}

template <class V, bool kHessian>
double element_time(int repeats) {
  constexpr int kCount = 256;
  std::vector<Element<V>> elements;
  elements.reserve(kCount);
  for (int i = 0; i < kCount; ++i) elements.push_back(element<V>(V(0.001 * i)));
  std::vector<V> results(kCount);
  const double time = nanoseconds(repeats * 20, [&] {
    for (int i = 0; i < kCount; ++i) {
      const Element<V>& e = elements[static_cast<std::size_t>(i)];
      const auto k = vertex_kinematics(e.before, e.after, V(0.2));
      const auto stresses = vertex_stresses(k.strains, e.material);
      const auto n = vertex_stress_vectors(e.before, e.after, k, stresses);
      const Vec3<V> moment = vertex_moment(n, stresses);
      const auto s = rods::stretch(e.after.length, V(1.0), V(100.0));
      if constexpr (kHessian) {
        const Sym3<V> a = vertex_stiffness(e.before, e.after, k, n, stresses, e.material);
        const auto own = edge_block(e.after, moment, a);
        const auto cross = cross_block(e.before, e.after, moment, a);
        const Sym3<V> ee = own.ee + rods::stretch_stiffness(s, e.after.tangent, e.after.length);
        results[static_cast<std::size_t>(i)] =
            ee.xx + ee.yx + ee.yy + ee.zx + ee.zy + ee.zz + own.et.x + own.et.y + own.et.z +
            own.tt + dot(cross.ee.column[0], cross.ee.column[1]) +
            dot(cross.ee.column[2], cross.te) + dot(cross.et, cross.et) + cross.tt;
      } else {
        const auto g = edge_gradient(e.after, moment, s.tension);
        results[static_cast<std::size_t>(i)] = g.force.x + g.force.y + g.force.z + g.torque;
      }
    }
  });
  volatile double sink = 0;
  for (const V& r : results) {
    if constexpr (std::is_same_v<V, double>)
      sink = sink + r;
    else
      sink = sink + r[0];
  }
  int lanes = 1;
  if constexpr (!std::is_same_v<V, double>) lanes = static_cast<int>(V::size());
  return time / kCount / lanes;
}

}  // namespace

RodKernelTimes time_rod_kernels(int rods, int repeats) {
  constexpr int kEdges = 11;
  const auto layout =
      std::make_shared<const RodLayout>(std::vector<int>(static_cast<std::size_t>(rods), kEdges));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(layout->unknowns());
  RodParameters parameters(*layout);
  for (int slot = 0; slot < layout->nodes(); ++slot) {
    x.segment<4>(4 * slot) << slot, std::sin(slot), 0.3 * std::cos(2.0 * slot), 0.1 * slot;
    for (const auto p :
         {RodParameters::kRestLength, RodParameters::kStretching, RodParameters::kBending1,
          RodParameters::kBending2, RodParameters::kTorsion})
      parameters(slot, p) = 1.2;
  }
  const RodAtSource at(RodState(layout,
                                std::make_shared<const SourceFrames>(SourceFrames::without_twist(
                                    *layout, x, Eigen::Matrix3Xd::Zero(3, layout->rods()))),
                                x));
  const int threads = thread_count();
  set_thread_count(1);
  const double vertices = static_cast<double>(rods) * (kEdges - 1);
  volatile double sink = 0;
  RodKernelTimes t;
  t.element_gradient_scalar = element_time<double, false>(repeats);
  t.element_gradient_pack = element_time<Lane, false>(repeats);
  t.element_hessian_scalar = element_time<double, true>(repeats);
  t.element_hessian_pack = element_time<Lane, true>(repeats);
  const auto per_vertex = [&](auto&& work) { return nanoseconds(repeats, work) / vertices; };
  t.state = per_vertex([&] { sink = at.moved(x).twist_slots()(1, 0); });
  t.gradient = per_vertex([&] { sink = at.state().forces(parameters).energies.total(); });
  t.rebase = per_vertex([&] { sink = RodAtSource(at.state()).state().twist_slots()(1, 0); });
  t.hessian = per_vertex([&] { sink = at.hessian(parameters).values()(1, 1); });
  t.hessian_vector_product = per_vertex([&] {
    sink = gradient_derivative(at.state(), parameters, {x, nullptr})[1];
  });
  t.third_derivatives = per_vertex([&] {
    sink = hessian_derivative(at.state(), parameters, {x, nullptr}).values()(1, 1);
  });
  set_thread_count(threads);
  return t;
}

}  // namespace limber::bench
