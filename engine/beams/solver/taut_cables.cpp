#include "engine/beams/solver/taut_cables.h"

#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/index.h"
#include "engine/base/numerics/nnls.h"

namespace limber::beams::detail {

namespace {

constexpr Eigen::Index kMaxTaut = 1000;  // n^2 numbers, and as many solutions as cables
// Share of the energy of cables: softer parts hold nothing.
constexpr double kNothing = 1e-12;

/// Derivatives of a cable's stretch: rows of free unknowns with their values.
std::vector<std::pair<int, double>> stretch_gradient(const BeamStructure& structure,
                                                     const BeamState& state,
                                                     const Stiffness& stiffness, int element) {
  const BeamElement& cable = structure.model().elements[index(element)];
  const Eigen::Vector3d t =
      (state.positions.col(cable.finish) - state.positions.col(cable.start)).normalized();
  std::vector<std::pair<int, double>> result;
  for (const auto& [node, sign] : {std::pair{cable.start, -1.0}, {cable.finish, 1.0}}) {
    const Eigen::Vector3d by_node = structure.node_axes(node).transpose() * t;
    for (int k = 0; k < 3; ++k) {
      const int row = stiffness.row_of(6 * node + k);
      if (row >= 0) result.emplace_back(row, sign * by_node[k]);
    }
  }
  return result;
}

/// Is the stiffness positive definite without any of these cables?
bool stands_without(const std::vector<int>& cables, const BeamStructure& structure,
                    const BeamState& state, const Stiffness& stiffness) {
  Eigen::SparseMatrix<double> lower = stiffness.matrix();
  for (const int cable : cables) {
    const double half = 0.5 * structure.constants(cable).stretching;
    const auto gradient = stretch_gradient(structure, state, stiffness, cable);
    for (const auto& [row, a] : gradient) {
      for (const auto& [column, b] : gradient)
        if (row >= column) lower.coeffRef(row, column) -= half * a * b;
    }
  }
  SparseCholesky factor;
  try {
    factor.analyse(lower);
    factor.refactor(lower);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kNumerical) throw;
    return false;
  }
  return true;
}

}  // namespace

std::vector<int> just_taut_cables(const BeamStructure& structure, const BeamState& state) {
  std::vector<int> result;
  for (int e = 0; e < structure.elements(); ++e) {
    if (structure.model().elements[index(e)].kind == BeamKind::kCable &&
        cable_tension(structure.constants(e), structure.ends(state, e)) == CableTension::kJustTaut)
      result.push_back(e);
  }
  return result;
}

std::optional<Eigen::VectorXd> direction_that_slackens(const BeamStructure& structure,
                                                       const BeamState& state,
                                                       const Stiffness& stiffness,
                                                       const SparseCholesky& factor,
                                                       const Eigen::VectorXd& noise) {
  std::vector<int> cables = just_taut_cables(structure, state);
  if (cables.empty()) return {};
  const bool is_judged = std::ssize(cables) <= kMaxTaut;
  if (!is_judged && stands_without(cables, structure, state, stiffness)) return {};
  if (!is_judged) cables.resize(1);
  const auto count = static_cast<Eigen::Index>(cables.size());
  Eigen::MatrixXd gradients = Eigen::MatrixXd::Zero(stiffness.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (const auto& [row, value] :
         stretch_gradient(structure, state, stiffness, cables[static_cast<std::size_t>(i)]))
      gradients(row, i) += value;
  }
  Eigen::VectorXd roots(count);  // of half the stiffnesses
  for (Eigen::Index i = 0; i < count; ++i)
    roots[i] = std::sqrt(0.5 * structure.constants(cables[static_cast<std::size_t>(i)]).stretching);
  const Eigen::MatrixXd scaled = gradients * roots.asDiagonal();
  const Eigen::MatrixXd moved = factor.solve(scaled);
  if (!is_judged) return Eigen::VectorXd(-moved.col(0));
  // Least (w^T (1 - B) w + (1 - sum w)^2) / 2 over w >= 0.
  const Eigen::MatrixXd gram = Eigen::MatrixXd::Identity(count, count) -
                               scaled.transpose() * moved + Eigen::MatrixXd::Ones(count, count);
  const Eigen::VectorXd shares =
      nnls(0.5 * (gram + gram.transpose()), Eigen::VectorXd::Ones(count)).x;
  const Eigen::VectorXd direction = -(moved * shares);
  const Eigen::VectorXd stretches = scaled.transpose() * direction;
  const double mean = direction.dot(stiffness.times(direction));
  const double energy = mean + stretches.dot(stretches.cwiseAbs());
  if (energy > direction.dot(noise.cwiseProduct(direction)) + kNothing * mean) return {};
  return direction;
}

}  // namespace limber::beams::detail
