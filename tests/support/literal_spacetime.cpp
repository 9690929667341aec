#include "tests/support/literal_spacetime.h"

#include <Eigen/CholmodSupport>
#include <Eigen/Sparse>
#include <cmath>
#include <map>

namespace limber::testing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using Triplet = Eigen::Triplet<double>;

namespace {

int pinned(spacetime::EndCondition end) { return static_cast<int>(end); }

}  // namespace

class LiteralSpacetime::Impl {
 public:
  std::shared_ptr<const reduced::Kinematics> kinematics;
  spacetime::ModeDynamics dynamics;
  spacetime::Timeline timeline;
  std::vector<spacetime::PositionConstraint> constraints;
  spacetime::SolverOptions options;

  int modes = 0, frames = 0, first = 0, last = 0;  // free frames first .. last
  std::vector<int> columns;                        // distinct constrained frames
  std::vector<reduced::SiteQuery> queries;
  VectorXd weight, target;  // 3 per constraint; weight 0 on unwanted axes; unitless
  Sparse force_hessian;     // H_f of the free unknowns, lower triangle
  std::vector<Triplet> force_triplets, triplets;
  Sparse hessian;
  Eigen::CholmodSupernodalLLT<Sparse, Eigen::Lower> cholmod;
  MatrixXd columns_z, jacobian;
  Eigen::Matrix3Xd u;

  [[nodiscard]] Index unknown(int frame, int mode) const {
    return static_cast<Index>(frame - first) * modes + mode;
  }
  [[nodiscard]] bool is_free(int frame) const { return frame >= first && frame <= last; }

  void prepare() {
    modes = static_cast<int>(dynamics.stiffness.size());
    frames = timeline.frame_count;
    first = pinned(timeline.first);
    last = frames - 1 - pinned(timeline.last);
    std::map<int, int> column_of;
    for (const auto& constraint : constraints) column_of.emplace(constraint.frame, 0);
    for (auto& [frame, column] : column_of) {
      column = static_cast<int>(columns.size());
      columns.push_back(frame);
    }
    weight.setZero(3 * static_cast<Index>(constraints.size()));
    target.setZero(weight.size());
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const auto& constraint = constraints[i];
      queries.push_back({constraint.site, column_of[constraint.frame]});
      for (int axis = 0; axis < 3; ++axis) {
        const Index row = 3 * static_cast<Index>(i) + axis;
        if ((constraint.axes >> axis & 1U) != 0) weight[row] = constraint.weight;
        target[row] = constraint.target[axis] / kinematics->length();
      }
    }
    assemble_force();
  }

  void assemble_force() {
    for (int k = 0; k < modes; ++k) {
      const double row[3] = {1, -2 - dynamics.damping[k] + dynamics.stiffness[k],
                             1 + dynamics.damping[k]};
      for (int i = 1; i + 1 < frames; ++i) {
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b <= a; ++b) {
            if (!is_free(i - 1 + a) || !is_free(i - 1 + b)) continue;
            force_triplets.emplace_back(unknown(i - 1 + a, k), unknown(i - 1 + b, k),
                                        row[a] * row[b]);
          }
        }
      }
    }
    const Index size = static_cast<Index>(last - first + 1) * modes;
    force_hessian.resize(size, size);
    force_hessian.setFromTriplets(force_triplets.begin(), force_triplets.end());
    hessian.resize(size, size);
  }

  void evaluate(const MatrixXd& z, bool with_jacobian, VectorXd& residual) {
    columns_z.setZero(kinematics->coordinate_count(), static_cast<Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      columns_z.col(static_cast<Index>(c)).head(modes) = z.col(columns[c]);
    }
    kinematics->evaluate(columns, columns_z, queries, u, with_jacobian ? &jacobian : nullptr);
    residual = target - Eigen::Map<const VectorXd>(u.data(), u.size()) / kinematics->length();
    if (with_jacobian) jacobian /= kinematics->length();
  }

  [[nodiscard]] double force(const MatrixXd& z) const {
    double sum = 0;
    for (int i = 1; i + 1 < frames; ++i) {
      for (int k = 0; k < modes; ++k) {
        const double acceleration = z(k, i + 1) - 2 * z(k, i) + z(k, i - 1);
        const double velocity = z(k, i + 1) - z(k, i);
        const double value =
            acceleration + dynamics.damping[k] * velocity + dynamics.stiffness[k] * z(k, i);
        sum += value * value;
      }
    }
    return 0.5 * sum;
  }

  [[nodiscard]] double energy(const MatrixXd& z, const VectorXd& residual) const {
    return force(z) + 0.5 * residual.cwiseAbs2().dot(weight);
  }

  /// grad E, of the free unknowns.
  [[nodiscard]] VectorXd gradient(const VectorXd& free_z, const VectorXd& residual) const {
    VectorXd g = force_hessian.selfadjointView<Eigen::Lower>() * free_z;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const int frame = constraints[i].frame;
      if (!is_free(frame)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const Index row = 3 * static_cast<Index>(i) + axis;
        g.segment(unknown(frame, 0), modes) -=
            weight[row] * residual[row] * jacobian.row(row).head(modes).transpose();
      }
    }
    return g;
  }

  void assemble() {
    triplets = force_triplets;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const int frame = constraints[i].frame;
      if (!is_free(frame)) continue;
      for (int k = 0; k < modes; ++k) {
        for (int l = 0; l <= k; ++l) {
          double sum = 0;
          for (int axis = 0; axis < 3; ++axis) {
            const Index row = 3 * static_cast<Index>(i) + axis;
            sum += weight[row] * jacobian(row, k) * jacobian(row, l);
          }
          triplets.emplace_back(unknown(frame, k), unknown(frame, l), sum);
        }
      }
    }
    hessian.setFromTriplets(triplets.begin(), triplets.end());
  }
};

LiteralSpacetime::LiteralSpacetime(std::shared_ptr<const reduced::Kinematics> kinematics,
                                   spacetime::ModeDynamics dynamics, spacetime::Timeline timeline,
                                   std::vector<spacetime::PositionConstraint> constraints,
                                   spacetime::SolverOptions options)
    : impl_(std::make_unique<Impl>()) {
  impl_->kinematics = std::move(kinematics);
  impl_->dynamics = std::move(dynamics);
  impl_->timeline = timeline;
  impl_->constraints = std::move(constraints);
  impl_->options = options;
  impl_->prepare();
}

LiteralSpacetime::~LiteralSpacetime() = default;

double LiteralSpacetime::force_energy(const MatrixXd& z) const { return impl_->force(z); }

double LiteralSpacetime::constraint_energy(const MatrixXd& z) const {
  VectorXd residual;
  impl_->evaluate(z, false, residual);
  return 0.5 * residual.cwiseAbs2().dot(impl_->weight);
}

LiteralResult LiteralSpacetime::solve_cold() {
  Impl& s = *impl_;
  LiteralResult result;
  MatrixXd z = MatrixXd::Zero(s.modes, s.frames), trial = z;
  VectorXd free_z = VectorXd::Zero(s.hessian.rows()), residual, trial_residual;
  s.evaluate(z, true, residual);
  const double rest = 0.5 * residual.cwiseAbs2().dot(s.weight);
  double energy = rest;
  bool analysed = false;
  for (; result.iterations < s.options.max_iterations; ++result.iterations) {
    const VectorXd g = s.gradient(free_z, residual);
    s.assemble();
    if (!analysed) s.cholmod.analyzePattern(s.hessian);
    analysed = true;
    s.cholmod.factorize(s.hessian);
    if (s.cholmod.info() != Eigen::Success) break;
    const VectorXd step = -s.cholmod.solve(g);
    const double decrement2 = -g.dot(step);
    result.gradient = std::sqrt(std::max(0.0, decrement2) / (2 * (energy + 1e-6 * rest)));
    if (result.gradient <= s.options.gradient_tolerance) {
      result.converged = true;
      break;
    }
    double taken = 1;
    bool lower = false;
    for (int halving = 0; halving < 40 && !lower; ++halving, taken *= 0.5) {
      trial.middleCols(s.first, s.last - s.first + 1).reshaped() = free_z + taken * step;
      s.evaluate(trial, false, trial_residual);
      const double value = s.energy(trial, trial_residual);
      lower = value < energy || (decrement2 < 1e-12 * energy && value <= energy * (1 + 1e-14));
      if (lower) {
        energy = value;
        free_z += taken * step;
        z = trial;
      }
    }
    if (!lower) break;
    s.evaluate(z, true, residual);
  }
  result.z = z;
  result.force_energy = s.force(z);
  result.constraint_energy = 0.5 * residual.cwiseAbs2().dot(s.weight);
  result.total_energy = result.force_energy + result.constraint_energy;
  return result;
}

}  // namespace limber::testing
