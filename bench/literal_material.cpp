#include "bench/literal_material.h"

#include <lbfgs.h>

#include <algorithm>
#include <chrono>
#include <map>

#include "tests/support/literal_spacetime.h"

namespace limber::bench {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;

/// u(S z) as kinematics of z.
class MixedKinematics final : public reduced::Kinematics {
 public:
  MixedKinematics(std::shared_ptr<const reduced::Kinematics> inner, MatrixXd mixing)
      : inner_(std::move(inner)), mixing_(std::move(mixing)) {}

  [[nodiscard]] int coordinate_count() const override { return static_cast<int>(mixing_.cols()); }
  [[nodiscard]] double length() const override { return inner_->length(); }
  [[nodiscard]] bool moves(reduced::SiteId site) const override { return inner_->moves(site); }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                MatrixXd* jacobian) const override {
    MatrixXd hat;
    inner_->evaluate(frames, mixing_ * z, queries, u, jacobian != nullptr ? &hat : nullptr);
    if (jacobian != nullptr) jacobian->noalias() = hat * mixing_;
  }

 private:
  std::shared_ptr<const reduced::Kinematics> inner_;
  MatrixXd mixing_;
};

/// gamma E_c + mu E_s as a function of S alone.
class MixingProblem {
 public:
  MixingProblem(const reduced::Kinematics& kinematics,
                const std::vector<spacetime::PositionConstraint>& constraints, const MatrixXd& z,
                double column_weight)
      : kinematics_(kinematics), constraints_(constraints), column_weight_(column_weight) {
    std::map<int, int> column_of;
    for (const auto& constraint : constraints) column_of.emplace(constraint.frame, 0);
    for (auto& [frame, column] : column_of) {
      column = static_cast<int>(frames_.size());
      frames_.push_back(frame);
    }
    for (const auto& constraint : constraints)
      queries_.push_back({constraint.site, column_of[constraint.frame]});
    z_.resize(z.rows(), static_cast<Eigen::Index>(frames_.size()));
    for (std::size_t i = 0; i < frames_.size(); ++i)
      z_.col(static_cast<Eigen::Index>(i)) = z.col(frames_[i]);
  }

  double evaluate(const MatrixXd& mixing, MatrixXd* gradient) const {
    Eigen::Matrix3Xd u;
    MatrixXd jacobian;
    const double scale = 1 / kinematics_.length();
    kinematics_.evaluate(frames_, mixing * z_, queries_, u,
                         gradient != nullptr ? &jacobian : nullptr);
    double energy = column_weight_ * spacetime::column_energy(mixing);
    if (gradient != nullptr) {
      const RowVectorXd excess =
          4 * column_weight_ * (mixing.colwise().squaredNorm().array() - 1).matrix();
      *gradient = mixing * excess.asDiagonal();
    }
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      const auto& constraint = constraints_[i];
      for (int axis = 0; axis < 3; ++axis) {
        if ((constraint.axes >> axis & 1U) == 0) continue;
        const Eigen::Index row = 3 * static_cast<Eigen::Index>(i) + axis;
        const double residual =
            scale * (constraint.target[axis] - u(axis, static_cast<Eigen::Index>(i)));
        energy += 0.5 * constraint.weight * residual * residual;
        if (gradient == nullptr) continue;
        *gradient -= constraint.weight * residual * scale * jacobian.row(row).transpose() *
                     z_.col(queries_[i].column).transpose();
      }
    }
    return energy;
  }

  /// @returns the number of iterations
  int minimise(MatrixXd& mixing, int iterations) const {
    shape_ = {mixing.rows(), mixing.cols()};
    lbfgs_parameter_t parameters;
    lbfgs_parameter_init(&parameters);
    parameters.max_iterations = iterations;
    parameters.epsilon = 1e-10;
    taken_ = 0;
    // However it stops (even by a failed line search), x is the best point so far.
    lbfgs(static_cast<int>(mixing.size()), mixing.data(), nullptr, &MixingProblem::value,
          &MixingProblem::count, const_cast<MixingProblem*>(this), &parameters);
    return taken_;
  }

 private:
  static double value(void* self, const double* x, double* g, int /*n*/, double /*step*/) {
    const auto& problem = *static_cast<const MixingProblem*>(self);
    MatrixXd gradient;
    const double energy = problem.evaluate(
        Eigen::Map<const MatrixXd>(x, problem.shape_.first, problem.shape_.second), &gradient);
    Eigen::Map<MatrixXd>(g, gradient.rows(), gradient.cols()) = gradient;
    return energy;
  }
  static int count(void* self, const double* /*x*/, const double* /*g*/, double /*energy*/,
                   double /*xnorm*/, double /*gnorm*/, double /*step*/, int /*n*/, int k,
                   int /*evaluations*/) {
    static_cast<MixingProblem*>(self)->taken_ = k;
    return 0;
  }

  const reduced::Kinematics& kinematics_;
  const std::vector<spacetime::PositionConstraint>& constraints_;
  double column_weight_;
  std::vector<int> frames_;
  std::vector<reduced::SiteQuery> queries_;
  MatrixXd z_;
  mutable std::pair<Eigen::Index, Eigen::Index> shape_;
  mutable int taken_ = 0;
};

/// Section 5.4: each a quotient, one after the other, clipped at its bounds.
void fit_dynamics(const MatrixXd& z, double max_stiffness, spacetime::ModeDynamics& dynamics) {
  const Eigen::Index inner = z.cols() - 2;
  for (Eigen::Index k = 0; k < z.rows(); ++k) {
    const RowVectorXd here = z.row(k).segment(1, inner);
    const RowVectorXd velocity = z.row(k).tail(inner) - here;
    const RowVectorXd acceleration = velocity - here + z.row(k).head(inner);
    const auto quotient = [](const RowVectorXd& force, const RowVectorXd& along) {
      const double square = along.squaredNorm();
      return square > 0 ? std::max(0.0, -force.dot(along) / square) : 0.0;
    };
    dynamics.stiffness[k] =
        std::min(max_stiffness, quotient(acceleration + dynamics.damping[k] * velocity, here));
    dynamics.damping[k] = quotient(acceleration + dynamics.stiffness[k] * here, velocity);
  }
}

}  // namespace

LiteralMaterialResult literal_material(
    const std::shared_ptr<const reduced::Kinematics>& kinematics,
    const spacetime::Timeline& timeline,
    const std::vector<spacetime::PositionConstraint>& constraints, spacetime::Material start,
    const LiteralMaterialOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  LiteralMaterialResult result{std::move(start), {}, 0, 0, 0, 0, 0, {}, {}};
  spacetime::SolverOptions z_options;
  z_options.gradient_tolerance = options.z_tolerance;
  z_options.max_iterations = options.z_iterations;
  const bool fits_dynamics = options.variables != spacetime::MaterialVariables::kMotion;
  for (int round = 0; round < options.outer_rounds; ++round) {
    const double frequency = round < options.slow_rounds
                                 ? std::min(options.slow_frequency, options.max_frequency)
                                 : options.max_frequency;
    const double max_stiffness = spacetime::stiffness_of(frequency);
    auto& stiffness = result.material.dynamics.stiffness;
    if (fits_dynamics) stiffness = stiffness.cwiseMin(max_stiffness);
    testing::LiteralSpacetime method(
        std::make_shared<const MixedKinematics>(kinematics, result.material.mixing),
        result.material.dynamics, timeline, constraints, z_options);
    const testing::LiteralResult solved =
        round == 0 ? method.solve_continued() : method.solve_from(result.motion);
    result.motion = solved.z;
    result.inner_iterations += solved.iterations;
    if (fits_dynamics) {
      fit_dynamics(result.motion, max_stiffness, result.material.dynamics);
      ++result.inner_iterations;
    }
    const MixingProblem problem(*kinematics, constraints, result.motion, options.column_weight);
    if (options.variables == spacetime::MaterialVariables::kAll)
      result.inner_iterations +=
          problem.minimise(result.material.mixing, options.mixing_iterations);
    result.force_energy = spacetime::force_energy(result.material.dynamics, result.motion);
    result.constraint_energy = problem.evaluate(result.material.mixing, nullptr);
    result.total_energy = result.force_energy + result.constraint_energy;
    result.energies.push_back(result.total_energy);
    const std::chrono::duration<double, std::milli> since =
        std::chrono::steady_clock::now() - begin;
    result.milliseconds.push_back(since.count());
  }
  return result;
}

}  // namespace limber::bench
