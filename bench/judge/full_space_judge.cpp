#include "bench/judge/full_space_judge.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <cmath>

#include "engine/bodies/gradient_operator.h"

namespace limber::bench {
namespace {

using Eigen::Index;
using Vector9 = Eigen::Matrix<double, 9, 1>;

constexpr int kHeld = 2;  // frames at rest at either end

Eigen::Matrix3d cross(const Eigen::Vector3d& t) {
  Eigen::Matrix3d w;
  w << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return w;
}

Eigen::Matrix3d rotation(const Eigen::Vector3d& t) {
  const double angle = t.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, t / angle).toRotationMatrix();
}

/// R^T dR of exp(t), as the vector J(t) dt (right Jacobian of SO(3); Chirikjian 2012, 10.86).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& t) {
  const double angle = t.norm();
  const Eigen::Matrix3d w = cross(t);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - w / 2 + w * w / 6;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * w +
         (angle - std::sin(angle)) / (angle * angle * angle) * w * w;
}

Eigen::Vector3d axial(const Eigen::Matrix3d& h) {
  return Eigen::Vector3d(h(2, 1) - h(1, 2), h(0, 2) - h(2, 0), h(1, 0) - h(0, 1)) / 2;
}

class Judge {
 public:
  explicit Judge(const JudgedProblem& problem)
      : problem_(problem),
        gradient_(problem.body.mesh),
        free_(problem.frame_count - 2 * kHeld),
        modes_(problem.modes.cols()) {
    factor_modes();
    make_rows();
  }

  [[nodiscard]] double energy(const Eigen::MatrixXd& z, double& miss) const {
    double sum = 0;
    for (Index k = 0; k < modes_; ++k)
      sum += 0.5 * (a_[static_cast<std::size_t>(k)] * z.row(k).transpose()).squaredNorm();
    miss = 0;
    for (std::size_t i = 0; i < problem_.targets.size(); ++i) {
      const JudgedTarget& target = problem_.targets[i];
      const Eigen::Vector3d off = displacement(i, z.col(target.frame)) - target.target;
      miss = std::max(miss, off.norm());
      sum += 0.5 * target.weight * (off / problem_.length).squaredNorm();
    }
    return sum;
  }

  /// The Gauss-Newton step (K + J^T W J) d = -g through the constraints.
  Eigen::MatrixXd step(const Eigen::MatrixXd& z, double& promised) const {
    const auto count = static_cast<Index>(problem_.targets.size());
    Eigen::MatrixXd jacobian(3 * count, modes_);
    Eigen::VectorXd residual(3 * count), weight(3 * count);
    for (Index i = 0; i < count; ++i) {
      const JudgedTarget& target = problem_.targets[static_cast<std::size_t>(i)];
      jacobian.middleRows<3>(3 * i) =
          derivative(static_cast<std::size_t>(i), z.col(target.frame)) / problem_.length;
      residual.segment<3>(3 * i) =
          (displacement(static_cast<std::size_t>(i), z.col(target.frame)) - target.target) /
          problem_.length;
      weight.segment<3>(3 * i).setConstant(target.weight);
    }
    // K^-1 J^T of each mode, at all free frames: a row acts in its target's frame.
    std::vector<Eigen::MatrixXd> influence;
    for (Index k = 0; k < modes_; ++k) {
      Eigen::MatrixXd right = Eigen::MatrixXd::Zero(free_, 3 * count);
      for (Index row = 0; row < 3 * count; ++row)
        right(problem_.targets[static_cast<std::size_t>(row / 3)].frame - kHeld, row) =
            jacobian(row, k);
      influence.emplace_back(factor_[static_cast<std::size_t>(k)].solve(right));
    }
    Eigen::MatrixXd compliance = Eigen::MatrixXd::Zero(3 * count, 3 * count);
    Eigen::VectorXd linear(3 * count);  // J z
    for (Index row = 0; row < 3 * count; ++row) {
      const int frame = problem_.targets[static_cast<std::size_t>(row / 3)].frame;
      for (Index k = 0; k < modes_; ++k)
        compliance.row(row) +=
            jacobian(row, k) * influence[static_cast<std::size_t>(k)].row(frame - kHeld);
      linear[row] = jacobian.row(row) * z.col(frame);
    }
    const Eigen::MatrixXd system = compliance + Eigen::MatrixXd(weight.cwiseInverse().asDiagonal());
    // K (z + d) = -J^T m with m = W (residual + J d).
    const Eigen::VectorXd m = system.ldlt().solve(residual - linear);
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(modes_, problem_.frame_count);
    for (Index k = 0; k < modes_; ++k)
      next.row(k).segment(kHeld, free_) = -(influence[static_cast<std::size_t>(k)] * m).transpose();
    Eigen::MatrixXd d = next - z;
    double before = 0, after = 0;
    for (Index k = 0; k < modes_; ++k) {
      before += 0.5 * (a_[static_cast<std::size_t>(k)] * z.row(k).transpose()).squaredNorm();
      after += 0.5 * (a_[static_cast<std::size_t>(k)] * next.row(k).transpose()).squaredNorm();
    }
    for (Index row = 0; row < 3 * count; ++row) {
      const int frame = problem_.targets[static_cast<std::size_t>(row / 3)].frame;
      const double moved = residual[row] + jacobian.row(row).dot(d.col(frame));
      before += 0.5 * weight[row] * residual[row] * residual[row];
      after += 0.5 * weight[row] * moved * moved;
    }
    promised = before - after;
    return d;
  }

 private:
  void factor_modes() {
    const Index frames = problem_.frame_count;
    for (Index k = 0; k < modes_; ++k) {
      const double lambda = problem_.dynamics.stiffness[k], damping = problem_.dynamics.damping[k];
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(frames - 2, frames);
      for (Index i = 0; i < frames - 2; ++i)
        a.row(i).segment<3>(i) << 1, -2 - damping + lambda, 1 + damping;
      const Eigen::MatrixXd inner = a.middleCols(kHeld, free_);
      factor_.emplace_back(inner.transpose() * inner);
      a_.push_back(std::move(a));
    }
  }

  /// Rows of the inverse Laplacian of the targets' nodes.
  void make_rows() {
    const Index nodes = problem_.body.mesh.node_count();
    std::vector<Index> place(static_cast<std::size_t>(nodes), 0);
    for (const int node : problem_.body.fixed_nodes) place[static_cast<std::size_t>(node)] = -1;
    Index count = 0;
    for (Index& at : place)
      if (at == 0) at = count++;
    const Eigen::SparseMatrix<double> whole = gradient_.scalar_laplacian();
    std::vector<Eigen::Triplet<double>> entries;
    for (Index column = 0; column < whole.outerSize(); ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(whole, column); it; ++it) {
        const Index i = place[static_cast<std::size_t>(it.row())];
        const Index j = place[static_cast<std::size_t>(it.col())];
        if (i >= 0 && j >= 0) entries.emplace_back(i, j, it.value());
      }
    }
    Eigen::SparseMatrix<double> laplacian(count, count);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(laplacian);
    for (const JudgedTarget& target : problem_.targets) {
      Eigen::VectorXd unit = Eigen::VectorXd::Zero(count);
      unit[place[static_cast<std::size_t>(target.node)]] = 1;
      const Eigen::VectorXd phi = factor.solve(unit);
      Eigen::Matrix3Xd row(3, gradient_.tet_count());
      for (int e = 0; e < gradient_.tet_count(); ++e) {
        row.col(e).setZero();
        for (int a = 0; a < 4; ++a) {
          const Index at = place[static_cast<std::size_t>(gradient_.tets()(a, e))];
          if (at >= 0) row.col(e) += gradient_.shape_gradients(e).col(a) * phi[at];
        }
        row.col(e) *= gradient_.volumes()[e];
      }
      rows_.push_back(std::move(row));
    }
  }

  [[nodiscard]] Eigen::Vector3d displacement(std::size_t target, const Eigen::VectorXd& z) const {
    const Eigen::VectorXd v = problem_.modes * z;
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (int e = 0; e < gradient_.tet_count(); ++e) {
      const Eigen::Matrix3d h = gradient_.apply(v, e), strain = (h + h.transpose()) / 2;
      const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
      u += (rotation(axial(h)) * (one + strain) - one) * rows_[target].col(e);
    }
    return u;
  }

  [[nodiscard]] Eigen::Matrix3Xd derivative(std::size_t target, const Eigen::VectorXd& z) const {
    const Eigen::VectorXd v = problem_.modes * z;
    // d u / d v, 3 x 3n, tet by tet; then the chain rule.
    Eigen::MatrixXd nodes = Eigen::MatrixXd::Zero(problem_.modes.rows(), 3);
    for (int e = 0; e < gradient_.tet_count(); ++e) {
      const Eigen::Matrix3d h = gradient_.apply(v, e), strain = (h + h.transpose()) / 2;
      const Eigen::Vector3d t = axial(h);
      const Eigen::Matrix3d r = rotation(t), jr = right_jacobian(t);
      const Eigen::Vector3d p = rows_[target].col(e);
      const Eigen::Vector3d stretched = p + strain * p;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          Eigen::Matrix3d dh = Eigen::Matrix3d::Zero();
          dh(i, j) = 1;
          const Eigen::Vector3d du =
              r * cross(jr * axial(dh)) * stretched + r * ((dh + dh.transpose()) / 2) * p;
          for (int a = 0; a < 4; ++a)
            nodes.row(3 * gradient_.tets()(a, e) + i) +=
                gradient_.shape_gradients(e)(j, a) * du.transpose();
        }
      }
    }
    return nodes.transpose() * problem_.modes;
  }

  const JudgedProblem& problem_;
  bodies::GradientOperator gradient_;
  Index free_, modes_;
  std::vector<Eigen::MatrixXd> a_;                   // (N - 2) x N of each mode
  std::vector<Eigen::LLT<Eigen::MatrixXd>> factor_;  // of K
  std::vector<Eigen::Matrix3Xd> rows_;               // of each target, 3 x m
};

}  // namespace

Judgement judge(const JudgedProblem& problem, const Eigen::MatrixXd& start, int max_steps) {
  const Judge judge(problem);
  Judgement result;
  result.motion = start;
  result.energy = judge.energy(result.motion, result.max_miss);
  for (; result.steps < max_steps && !result.settled; ++result.steps) {
    double promised = 0;
    const Eigen::MatrixXd d = judge.step(result.motion, promised);
    if (promised <= 1e-12 * result.energy) {
      result.settled = true;
      break;
    }
    constexpr int kTrials = 20;
    double part = 1;
    bool is_lower = false;
    for (int trial = 0; trial < kTrials && !is_lower; ++trial, part /= 2) {
      const Eigen::MatrixXd next = result.motion + part * d;
      double miss = 0;
      const double energy = judge.energy(next, miss);
      is_lower = energy < result.energy - 1e-4 * part * promised;  // never where it is no number
      if (!is_lower) continue;
      result.motion = next;
      result.energy = energy;
      result.max_miss = miss;
    }
    if (!is_lower) break;
  }
  return result;
}

}  // namespace limber::bench
