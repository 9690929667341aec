// Smallest eigenpairs of bodies.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "bench/stability/box_bodies.h"
#include "bench/stability/long_elasticity.h"
#include "bench/stability/sweep.h"
#include "engine/bodies/modal_analysis.h"

namespace limber::bench::stability {
namespace {

using bodies::ElasticBody;
using bodies::Material;
using bodies::ModalBasis;
using bodies::ModalOptions;

constexpr double kAllowedModal = 1e-5;
constexpr const char* kModalCheck =
    "K and M of the tets in long double: energies, residuals, orthonormality, inertia";

ModalBasis modes_of(const ElasticBody& body, int count) {
  return bodies::modal_analysis(body, {.mode_count = count});
}

Finding finding_of(const ElasticBody& body, const ModalBasis& basis) {
  const double tolerance = ModalOptions{}.tolerance;
  const ModalCheck check = check_modes(body, basis);
  Finding finding;
  const bool is_certain =
      basis.max_residual <= tolerance && basis.eigenvalue_error <= kAllowedModal;
  finding.claim = is_certain ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = basis.modes.allFinite() && basis.eigenvalues.allFinite();
  finding.error = check.listed == check.counted ? check.error : 1;
  finding.allowed = kAllowedModal;
  finding.message = fmt::format(
      "residual {:.2g} (tolerance {:.2g}; found {:.2g}), eigenvalues off by {:.2g} (bound "
      "{:.2g}), {} of {} listed",
      basis.max_residual, tolerance, check.residual, check.eigenvalue_error, basis.eigenvalue_error,
      check.listed, check.counted);
  return finding;
}

Finding solved(const ElasticBody& body, int count = 20) {
  return finding_of(body, modes_of(body, count));
}

Sweep modal_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                  std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "bodies";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "20 modes";
  sweep.check = kModalCheck;
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

ElasticBody nearly_incompressible(double distance, Held held) {
  return box_body({12, 4, 4}, {3, 1, 1}, held, {1e6, 0.5 - distance, 1000});
}

Finding of_another_size(double size) {
  const auto box = [](double length) {
    return box_body({8, 3, 3}, length * Eigen::Vector3d(1, 0.3, 0.25), Held::kLeftFace,
                    {2e5, 0.4, 1100});
  };
  const ElasticBody body = box(size);
  const ModalBasis basis = modes_of(body, 20), metre = modes_of(box(1), 20);
  Finding finding = finding_of(body, basis);
  // Frequencies of one shape and material go with 1 / length.
  const Eigen::VectorXd scaled = size * size * basis.eigenvalues;
  finding.error =
      std::max(finding.error,
               ((scaled - metre.eigenvalues).array() / metre.eigenvalues.array()).abs().maxCoeff());
  return finding;
}

Finding far_from_the_origin(double distance) {
  ElasticBody body = box_body({8, 3, 3}, {1, 0.3, 0.25}, Held::kNothing, {1e6, 0.4, 1000});
  body.mesh.nodes.colwise() += distance * Eigen::Vector3d(0.6, -0.7, 0.4);
  body = prepared(body);
  return solved(body);
}

}  // namespace

Sweeps modal_sweeps() {
  const Material rubber{1e6, 0.4, 1000};
  Sweeps sweeps;
  sweeps.push_back(modal_sweep(
      "nearly incompressible, held", "0.5 - nu", decades(-1, -12, -1), 4,
      [](double distance) { return solved(nearly_incompressible(distance, Held::kLeftFace)); }));
  sweeps.push_back(modal_sweep(
      "nearly incompressible, free", "0.5 - nu", decades(-1, -12, -1), 4,
      [](double distance) { return solved(nearly_incompressible(distance, Held::kNothing)); }));
  sweeps.push_back(modal_sweep(
      "stiff layers in a free body", "contrast", decades(2, 14, 2), 4, [=](double contrast) {
        ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Held::kNothing, rubber);
        stiffen(body, contrast, [](const auto& x) { return std::fmod(x.x(), 1.0) < 0.5; });
        return solved(body);
      }));
  sweeps.push_back(
      modal_sweep("held half stiff", "contrast", decades(2, 14, 2), 4, [=](double contrast) {
        ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Held::kLeftFace, rubber);
        stiffen(body, contrast, [](const auto& x) { return x.x() < 2; });
        return solved(body);
      }));
  sweeps.push_back(
      modal_sweep("free half stiff", "contrast", decades(2, 14, 2), 4, [=](double contrast) {
        ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Held::kLeftFace, rubber);
        stiffen(body, contrast, [](const auto& x) { return x.x() > 2; });
        return solved(body);
      }));
  sweeps.push_back(
      modal_sweep("flat cells", "thickness [body lengths]", decades(-1, -8, -1), 4, [=](double t) {
        return solved(box_body({12, 4, 4}, {1, 0.3, t}, Held::kLeftFace, rubber), 15);
      }));
  sweeps.push_back(
      modal_sweep("one sliver in a sound body", "height of the sliver [cells]",
                  decades(-1, -14, -1), 6, [=](double height) {
                    ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Held::kLeftFace, rubber);
                    make_sliver(body, height);
                    return solved(prepared(body), 15);
                  }));
  Sweep size = modal_sweep("size", "length of the body [m]",
                           {1, 1e-1, 1e1, 1e-2, 1e2, 1e-3, 1e3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9},
                           13, of_another_size);
  size.check = "as above, and eigenvalues of the same body of 1 m";
  sweeps.push_back(size);
  sweeps.push_back(modal_sweep("far from the origin", "distance [body lengths]", decades(0, 12, 1),
                               7, far_from_the_origin));
  Sweep count = modal_sweep(
      "number of modes", "modes", {1, 8, 64, 200, 290, 299, 300, 301}, 5, [=](double modes) {
        return solved(box_body({5, 4, 3}, {1.3, 1, 0.8}, Held::kLeftFace, rubber),
                      static_cast<int>(modes));
      });
  count.asked = "modes of a body with 300 unknowns";
  sweeps.push_back(count);
  return sweeps;
}

}  // namespace limber::bench::stability
