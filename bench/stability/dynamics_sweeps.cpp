// Implicit steps of bodies without reduction.

#include <fmt/core.h>

#include <Eigen/Dense>
#include <cmath>

#include "bench/stability/box_bodies.h"
#include "bench/stability/sweep.h"
#include "engine/bodies/full_dynamics.h"
#include "tests/support/dense.h"

namespace limber::bench::stability {
namespace {

using bodies::ElasticBody;
using bodies::FullDynamics;
using bodies::StepReport;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::VectorXd;

constexpr double kAllowedStep = 1e-5;
constexpr int kPlainSteps = 8;

/// Forces of St. Venant and Kirchhoff's material, 3n, written down tet by tet.
VectorXd elastic_forces(const ElasticBody& body, const VectorXd& u) {
  const bodies::TetMesh& mesh = body.mesh;
  VectorXd forces = VectorXd::Zero(u.size());
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const Eigen::Vector4i tet = mesh.tets.col(e);
    Matrix3d edges, moved;
    for (int a = 0; a < 3; ++a) {
      edges.col(a) = mesh.nodes.col(tet[a + 1]) - mesh.nodes.col(tet[0]);
      moved.col(a) = u.segment<3>(3 * tet[a + 1]) - u.segment<3>(3 * tet[0]);
    }
    const Matrix3d inverse = edges.inverse();
    const Matrix3d h = moved * inverse;
    const Matrix3d strain = 0.5 * (h + h.transpose() + h.transpose() * h);
    const bodies::Material& material = mesh.material_of(e);
    const Matrix3d stress = material.lame_lambda() * strain.trace() * Matrix3d::Identity() +
                            2 * material.lame_mu() * strain;
    const Matrix3d pulls = edges.determinant() / 6 * (Matrix3d::Identity() + h) * stress *
                           inverse.transpose();  // on nodes 1 to 3
    for (int a = 0; a < 3; ++a) {
      forces.segment<3>(3 * tet[a + 1]) -= pulls.col(a);
      forces.segment<3>(3 * tet[0]) += pulls.col(a);
    }
  }
  return forces;
}

/// Distance of a step of Euler's backward rule from rest to the solution of its equations, in the
/// norm of energy and over the step's own. The reference is Newton's method in plain dense algebra.
double distance_from_solution(const ElasticBody& body, const FullDynamics& dynamics,
                              const VectorXd& force, double time_step) {
  std::vector<int> free;
  std::vector<char> fixed(static_cast<std::size_t>(body.mesh.node_count()), 0);
  for (const int node : body.fixed_nodes) fixed[static_cast<std::size_t>(node)] = 1;
  for (int u = 0; u < 3 * body.mesh.node_count(); ++u)
    if (fixed[static_cast<std::size_t>(u / 3)] == 0) free.push_back(u);
  const Eigen::MatrixXd mass = Eigen::MatrixXd(dynamics.mass())(free, free);
  const double per_square = 1 / (time_step * time_step);
  const VectorXd answer = dynamics.state().displacement;
  VectorXd u = answer;
  Eigen::MatrixXd hessian;
  for (int step = 0; step < kPlainSteps; ++step) {
    const VectorXd residual =
        per_square * mass * u(free) - elastic_forces(body, u)(free) - force(free);
    hessian = Eigen::MatrixXd(dynamics.elasticity().hessian(
                  u, bodies::StvkEnergy::Curvature::kExact))(free, free) +
              per_square * mass;
    u(free) -= reference::solve_symmetric(hessian, residual).col(0);
  }
  const VectorXd off = (u - answer)(free), whole = u(free);
  return std::sqrt(std::abs(off.dot(hessian * off) / whole.dot(hessian * whole)));
}

struct Push {
  double time_step = 1.0 / 240;  // [s]
  double force = 0.02;           // over E times the square of the body's length
};

Finding stepped(const ElasticBody& body, const Push& push) {
  bodies::DynamicsOptions options;
  options.scheme = bodies::TimeStepping::kImplicitEuler;
  options.time_step = push.time_step;
  FullDynamics dynamics(body, options);
  VectorXd force = VectorXd::Zero(3 * body.mesh.node_count());
  Index tip = 0;
  body.mesh.nodes.colwise().sum().maxCoeff(&tip);
  const double length = body.length();
  force.segment<3>(3 * tip) = push.force * body.mesh.materials[0].youngs_modulus * length * length *
                              Eigen::Vector3d(0.02, 0.05, -0.03);
  const StepReport report = dynamics.step(force);
  Finding finding;
  const bool has_converged = report.status == StepReport::Status::kConverged;
  finding.claim = has_converged ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = dynamics.state().displacement.allFinite();
  finding.allowed = kAllowedStep;
  finding.error = has_converged ? distance_from_solution(body, dynamics, force, push.time_step) : 0;
  finding.message = fmt::format("{} Newton steps, {:.2g} left", report.newton_steps, report.left);
  return finding;
}

ElasticBody box(double length, double nu) {
  return box_body({6, 2, 2}, length * Eigen::Vector3d(1, 0.3, 0.25), Held::kLeftFace,
                  {1e6, nu, 1000});
}

Sweep step_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                 std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "dynamics";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "one implicit step of a box under a force at its corner";
  sweep.check = "dense Newton's method on forces written down tet by tet";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps dynamics_sweeps() {
  return {
      step_sweep("length of the step", "time step [s]", decades(-6, 6), 10,
                 [](double step) { return stepped(box(1, 0.4), {step}); }),
      step_sweep("nearly incompressible", "0.5 - nu", decades(-1, -10, -1), 4,
                 [](double distance) { return stepped(box(1, 0.5 - distance), {}); }),
      step_sweep("size", "length of the body [m]", {1, 1e-3, 1e3, 1e-6, 1e-9}, 5,
                 [](double length) { return stepped(box(length, 0.4), {length / 240}); }),
      step_sweep("force", "force [0.001 E length^2]", decades(-3, 5), 4,
                 [](double force) {
                   return stepped(box(1, 0.4), {1, 0.02 * force});
                 }),
      step_sweep("contrast of stiffness", "contrast", decades(2, 12, 2), 4,
                 [](double contrast) {
                   ElasticBody body = box(1, 0.4);
                   stiffen(body, contrast, [](const auto& x) { return x.x() < 0.5; });
                   return stepped(body, {});
                 }),
      step_sweep("one sliver", "height of the sliver [cells]", decades(-1, -10, -1), 6,
                 [](double height) {
                   ElasticBody body = box(1, 0.4);
                   make_sliver(body, height);
                   return stepped(prepared(body), {});
                 }),
  };
}

}  // namespace limber::bench::stability
