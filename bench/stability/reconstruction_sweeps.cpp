// Rotation-strain coordinates near full turns, and their reconstruction.

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "bench/stability/box_bodies.h"
#include "bench/stability/sweep.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/rs_inverse.h"
#include "engine/reduced/scaled_modes.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::bench::stability {
namespace {

using bodies::ElasticBody;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kAllowedReconstruction = 1e-7;
constexpr double kAllowedSlope = 1e-5;
constexpr double kTurn = 2 * std::numbers::pi;

ElasticBody bar(double length) {
  return box_body({12, 2, 2}, length * Eigen::Vector3d(1, 0.2, 0.15), Held::kLeftFace,
                  {1e6, 0.4, 1000});
}

/// Sections of the bar along an arc of `angle` [rad].
VectorXd bend(const ElasticBody& body, double angle) {
  Eigen::Matrix3Xd x = body.mesh.nodes;
  const double length = body.mesh.nodes.row(0).maxCoeff(), radius = length / angle;
  for (Index i = 0; i < x.cols(); ++i) {
    const double turn = x(0, i) / radius, outside = radius - x(1, i);
    x(0, i) = outside * std::sin(turn);
    x(1, i) = radius - outside * std::cos(turn);
  }
  return reduced::testing::displacements(body, x);
}

/// u -> y -> u.
Finding comes_back(const ElasticBody& body, const VectorXd& u) {
  const reduced::FullReconstruction full(body);
  const reduced::RsInverse inverse(body, full.gradient());
  const VectorXd y = inverse.coordinates(u);
  const VectorXd back = full.from_coordinates(y);
  Finding finding;
  finding.claim = Claim::kConverged;
  finding.is_finite = y.allFinite() && back.allFinite();
  // A free body comes back up to a translation.
  Eigen::Matrix3Xd miss = (back - u).reshaped(3, u.size() / 3);
  if (body.is_free()) miss.colwise() -= miss.rowwise().mean().eval();
  finding.error = miss.norm() / u.norm();
  finding.allowed = kAllowedReconstruction;
  return finding;
}

/// A free body that turns as a whole by its rotation unknowns: where nodes go, and how fast.
Finding turned_as_a_whole(double angle) {
  const ElasticBody body = box_body({4, 2, 2}, {1, 0.5, 0.4}, Held::kNothing, {1e6, 0.4, 1000});
  const reduced::ScaledModes modes =
      reduced::scale_modes(body, bodies::modal_analysis(body, {.mode_count = 4}));
  const auto model = std::make_shared<reduced::ReducedModel>();
  model->node_count = body.mesh.node_count();
  model->length = body.length();
  model->rigid_count = modes.rigid_count;
  model->eigenvalues = modes.eigenvalues;
  model->modes = modes.modes;
  reduced::FullKinematics kinematics(body, model,
                                     std::make_shared<const reduced::FullReconstruction>(body));
  const int node = body.mesh.node_count() - 1;
  const reduced::SiteQuery query{kinematics.add_site({node}), 0};
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3;
  const Eigen::Vector3d arm =
      body.mesh.nodes.col(node) - body.mesh.nodes.rowwise().mean();  // a box of even cells
  const auto displaced = [&](const Eigen::Vector3d& theta, MatrixXd* jacobian) {
    MatrixXd z = MatrixXd::Zero(kinematics.coordinate_count(), 1);
    z.block<3, 1>(3, 0) = theta;
    Eigen::Matrix3Xd u;
    const int frame = 0;
    kinematics.evaluate({&frame, 1}, z, {&query, 1}, u, jacobian);
    return Eigen::Vector3d(u.col(0));
  };
  const auto expected = [&](const Eigen::Vector3d& theta) -> Eigen::Vector3d {
    const double by = theta.norm();
    return Eigen::AngleAxisd(by, by > 0 ? Eigen::Vector3d(theta / by) : axis) * arm - arm;
  };
  MatrixXd jacobian;
  const Eigen::Vector3d theta = angle * axis, u = displaced(theta, &jacobian);
  constexpr double kStep = 1e-4;
  double slope_error = 0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
    const Eigen::Vector3d slope = (expected(theta + step) - expected(theta - step)) / (2 * kStep);
    slope_error = std::max(slope_error, (jacobian.col(3 + i) - slope).norm() / arm.norm());
  }
  Finding finding;
  finding.claim = Claim::kConverged;
  finding.is_finite = u.allFinite() && jacobian.allFinite();
  // Differences have fewer exact digits than positions: both by their own limits.
  finding.error = std::max((u - expected(theta)).norm() / arm.norm(),
                           slope_error * kAllowedReconstruction / kAllowedSlope);
  finding.allowed = kAllowedReconstruction;
  return finding;
}

Sweep shape_sweep(const char* name, const char* parameter, std::vector<double> values,
                  std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "reduced";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "rotation-strain coordinates of a shape, and the shape of these";
  sweep.check = "the shape itself";
  sweep.required = static_cast<int>(values.size());
  sweep.values = std::move(values);
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps reconstruction_sweeps() {
  const std::vector<double> turns = {0.25,     0.5,      0.75,     0.9, 0.99,
                                     0.999,    1 - 1e-6, 1 - 1e-9, 1,   1 + 1e-9,
                                     1 + 1e-6, 1.001,    1.25,     2,   3};
  Sweeps sweeps = {
      shape_sweep("twist", "turns of the far end", turns,
                  [](double turn) {
                    const ElasticBody body = bar(1);
                    return comes_back(body, reduced::testing::twist(body, turn * kTurn));
                  }),
      shape_sweep("bend", "turns of the far end", turns,
                  [](double turn) {
                    const ElasticBody body = bar(1);
                    return comes_back(body, bend(body, turn * kTurn));
                  }),
      shape_sweep("size", "length of the body [m]", {1, 1e-3, 1e3, 1e-6, 1e-9},
                  [](double length) {
                    const ElasticBody body = bar(length);
                    return comes_back(body, bend(body, 0.6 * kTurn));
                  }),
      shape_sweep(
          "one sliver", "height of the sliver [cells]", decades(-1, -8, -1),
          [](double height) {
            ElasticBody body =
                box_body({12, 2, 2}, {1, 0.2, 0.15}, Held::kNothing, {1e6, 0.4, 1000});
            make_sliver(body, height);
            body = prepared(body);
            // Turned and stretched as a whole, which turns no sliver inside out.
            Eigen::Matrix3d map =
                Eigen::AngleAxisd(0.4 * kTurn, Eigen::Vector3d(1, 2, -2) / 3).toRotationMatrix();
            map *= Eigen::Vector3d(1.3, 0.8, 1.1).asDiagonal();
            const Eigen::Matrix3Xd& rest = body.mesh.nodes;
            return comes_back(
                body, reduced::testing::displacements(body, map * (rest.colwise() - rest.col(0))));
          }),
  };
  Sweep whole = shape_sweep("a free body turned as a whole", "turns", turns,
                            [](double turn) { return turned_as_a_whole(turn * kTurn); });
  whole.values.insert(whole.values.begin(), {1e-12, 1e-8, 1e-4});
  whole.values.push_back(100);
  whole.required = static_cast<int>(whole.values.size());
  whole.asked = "where a node is under the body's rotation unknowns, and the derivative";
  whole.check = "the rotation itself, and its differences";
  sweeps.push_back(whole);
  return sweeps;
}

}  // namespace limber::bench::stability
