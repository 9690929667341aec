#include "tests/engine/session/springs/chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/numerics/banded_cholesky.h"

namespace limber::session::springs {
namespace {

constexpr int kMaxIterations = 100'000;
/// Of the residual, by the largest force that a spring of twice its length or a load has.
constexpr double kTolerance = 1e-9;
/// No node moves farther in an iteration than this share of the mean rest length: springs turn with
/// their nodes, and the Hessian holds for small turns only.
constexpr double kMaxStepShare = 0.25;
/// By the largest stiffness: springs without tension do not resist sideways, and the matrix would
/// be singular.
constexpr double kMinShift = 1e-8;
constexpr double kArmijo = 1e-4, kRounding = 1e-14, kMinStep = 1e-10;

/// Pinned nodes stay: rows and columns of the identity.
void fix_pins(const Conditions& conditions, Potential& p) {
  const Eigen::Index band = p.hessian.rows();
  for (const auto& [node, position] : conditions.pins) {
    for (Eigen::Index j = 3 * Eigen::Index{node}; j < 3 * Eigen::Index{node} + 3; ++j) {
      p.gradient[j] = 0;
      p.hessian.col(j).setZero();
      for (Eigen::Index d = 1; d < band && d <= j; ++d) p.hessian(d, j - d) = 0;
      p.hessian(0, j) = 1;
    }
  }
}

/// A direction of descent: Newton's where the Hessian is positive definite, else of the Hessian
/// with as much of the identity as makes it so.
Shape descent(const Potential& p, double stiffness) {
  BandedCholesky factor;
  Eigen::MatrixXd shifted = p.hessian;
  for (double shift = kMinShift * stiffness;; shift *= 4) {
    shifted.row(0) = p.hessian.row(0).array() + shift;
    if (factor.factor(shifted)) break;
  }
  BandedCholesky::Columns x = -p.gradient;
  factor.solve(x);
  return Eigen::Map<const Shape>(x.data(), 3, x.rows() / 3);
}

}  // namespace

void demand_node(const Chain& chain, int node, const char* field) {
  if (node >= 0 && node < chain.nodes.cols()) return;
  throw Error(ErrorCode::kOutOfRange, field,
              fmt::format("node {} is outside 0 .. {}", node, chain.nodes.cols() - 1));
}

void demand_finite(const Eigen::Vector3d& vector, const char* field) {
  if (!vector.allFinite())
    throw Error(ErrorCode::kInvalidArgument, field, fmt::format("{} is not finite", field));
}

void validate(const Chain& chain) {
  if (chain.nodes.cols() < 2 || !chain.nodes.allFinite())
    throw Error(ErrorCode::kInvalidArgument, "nodes", "must be at least 2 finite positions");
  if (static_cast<Eigen::Index>(chain.springs.size()) != chain.nodes.cols() - 1)
    throw Error(ErrorCode::kInvalidArgument, "springs",
                fmt::format("there are {} springs for {} nodes, must be one less than nodes",
                            chain.springs.size(), chain.nodes.cols()));
  for (std::size_t i = 0; i < chain.springs.size(); ++i) {
    const Spring& spring = chain.springs[i];
    const bool is_valid = spring.stiffness > 0 && spring.rest_length > 0 &&
                          std::isfinite(spring.stiffness) && std::isfinite(spring.rest_length);
    if (!is_valid)
      throw Error(ErrorCode::kInvalidArgument, fmt::format("springs[{}]", i),
                  fmt::format("stiffness = {}, rest_length = {}, must be finite and > 0",
                              spring.stiffness, spring.rest_length));
  }
  for (const auto& [node, position] : chain.conditions.pins) {
    demand_node(chain, node, "pins");
    demand_finite(position, "pins");
  }
  for (const auto& [node, force] : chain.conditions.loads) {
    demand_node(chain, node, "loads");
    demand_finite(force, "loads");
  }
}

Potential potential(const Chain& chain, const Conditions& conditions, const Shape& shape) {
  Potential p;
  p.gradient = Eigen::VectorXd::Zero(shape.size());
  p.hessian = Eigen::MatrixXd::Zero(6, shape.size());
  const auto add_block = [&](Eigen::Index row, Eigen::Index column, const Eigen::Matrix3d& block) {
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index j = 0; j < 3; ++j)
        if (row + i >= column + j) p.hessian(row + i - column - j, column + j) += block(i, j);
  };
  for (std::size_t s = 0; s < chain.springs.size(); ++s) {
    const auto [k, rest] = chain.springs[s];
    const auto i = static_cast<Eigen::Index>(s), a = 3 * i, b = a + 3;
    const Eigen::Vector3d edge = shape.col(i + 1) - shape.col(i);
    const double length = std::max(edge.norm(), 1e-12 * rest);  // where both ends meet
    const Eigen::Vector3d along = edge / length, force = k * (length - rest) * along;
    const Eigen::Matrix3d block = k * ((1 - rest / length) * Eigen::Matrix3d::Identity() +
                                       rest / length * along * along.transpose());
    p.elastic += k / 2 * (length - rest) * (length - rest);
    p.gradient.segment<3>(a) -= force;
    p.gradient.segment<3>(b) += force;
    add_block(a, a, block);
    add_block(b, b, block);
    add_block(b, a, -block);
  }
  for (const auto& [node, force] : conditions.loads) {
    p.work += force.dot(shape.col(node));
    p.gradient.segment<3>(3 * Eigen::Index{node}) -= force;
  }
  return p;
}

Equilibrium find_equilibrium(const Chain& chain, const Conditions& conditions, Shape shape,
                             const Cancellation& cancellation,
                             const std::function<void(const Shape&)>& on_iterate) {
  if (conditions.pins.empty() && !conditions.loads.empty())
    throw Error(ErrorCode::kNumerical, "", "the chain has loads and no pin: pin a node");
  double stiffness = 0, force = 0, mean_length = 0;
  for (const Spring& spring : chain.springs) {
    stiffness = std::max(stiffness, spring.stiffness);
    force = std::max(force, spring.stiffness * spring.rest_length);
    mean_length += spring.rest_length / static_cast<double>(chain.springs.size());
  }
  for (const auto& [node, load] : conditions.loads) force = std::max(force, load.norm());
  for (const auto& [node, position] : conditions.pins) shape.col(node) = position;

  Report report;
  for (;; ++report.iterations) {
    Potential p = potential(chain, conditions, shape);
    if (!std::isfinite(p.value()))
      throw Error(ErrorCode::kNumerical, "", "the energy of the springs is not finite");
    fix_pins(conditions, p);
    report.residual = p.gradient.lpNorm<Eigen::Infinity>();
    report.elastic = p.elastic;
    report.message =
        fmt::format("residual {:.3g} N after {} iterations", report.residual, report.iterations);
    if (cancellation.requested())
      report.status = Status::kCancelled;
    else if (report.residual <= kTolerance * force)
      report.status = Status::kConverged;
    else if (report.iterations < kMaxIterations) {
      Shape step = descent(p, stiffness);
      step *= std::min(1.0, kMaxStepShare * mean_length / step.colwise().norm().maxCoeff());
      const double slope = p.gradient.dot(step.reshaped());
      const double slack = kRounding * (p.elastic + std::abs(p.work));
      double share = 1;
      while (share > kMinStep && potential(chain, conditions, shape + share * step).value() >
                                     p.value() + kArmijo * share * slope + slack)
        share /= 2;
      if (share > kMinStep) {
        shape += share * step;
        on_iterate(shape);
        continue;
      }
    }
    return {std::move(shape), std::move(report)};
  }
}

}  // namespace limber::session::springs
