#include "engine/rods/solver/condensed_matrix.h"

#include <algorithm>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

/// Expands one chain: where its numbers come from in the reduced vector.
class ChainMap {
 public:
  ChainMap(const CondensedMatrix& matrix, int chain)
      : structure_(matrix.structure()),
        chain_(structure_.chains()[chain]),
        place_(structure_.place(chain)),
        batch_(structure_.batches()[place_.batch]),
        begin_(structure_.chain_begin(chain)),
        matrix_(matrix) {}

  [[nodiscard]] int numbers() const { return batch_.numbers(); }

  [[nodiscard]] double entry(int row, int column) const {
    return matrix_.band(
        place_.batch)[(column * kBandHeight + row - column) * kChainLanes + place_.lane];
  }

  /// Calls visit(unknown, coefficient) for the reduced unknowns a number depends on.
  template <class Visit>
  void unknowns(int number, const Visit& visit) const {
    if (number < batch_.begin()) {
      joint_unknowns(0, number, chain_.start_joint, visit);
    } else if (number >= batch_.end()) {
      joint_unknowns(1, number - batch_.end(), chain_.finish_joint, visit);
    } else {
      visit(begin_ + number - batch_.begin(), 1.0);
    }
  }

 private:
  template <class Visit>
  void joint_unknowns(int end, int row, int joint, const Visit& visit) const {
    const double* const jacobian =
        matrix_.terminal(place_.batch, end) + row * kJointSize * kChainLanes;
    for (int k = 0; k < kJointSize; ++k)
      visit(structure_.joint_begin(joint) + k, jacobian[k * kChainLanes + place_.lane]);
  }

  const ChainBatches& structure_;
  const Chain& chain_;
  ChainBatches::Place place_;
  const ChainBatch& batch_;
  int begin_;
  const CondensedMatrix& matrix_;
};

}  // namespace

CondensedMatrix::CondensedMatrix(std::shared_ptr<const ChainBatches> structure)
    : structure_(std::move(structure)),
      band_(structure_->band_lanes()),
      terminals_(terminal_offset(static_cast<int>(structure_->batches().size()), 0)),
      joints_(static_cast<std::size_t>(structure_->joints()) * 81, 0.0) {}

void CondensedMatrix::set_zero() {
  std::fill(band_.begin(), band_.end(), detail::LaneCell{});
  std::fill(terminals_.begin(), terminals_.end(), detail::LaneCell{});
  std::fill(joints_.begin(), joints_.end(), 0.0);
}

double& CondensedMatrix::entry(int chain, int row, int column) {
  const ChainBatches::Place place = structure_->place(chain);
  LIMBER_DEMAND(column >= 0 && row >= column && row - column < kBandHeight);
  LIMBER_DEMAND(row < structure_->batches()[place.batch].numbers());
  return band(place.batch)[(column * kBandHeight + row - column) * kChainLanes + place.lane];
}

void CondensedMatrix::set_terminal(int chain, int end,
                                   const Eigen::Matrix<double, 7, 9>& jacobian) {
  const ChainBatches::Place place = structure_->place(chain);
  double* const target = terminal(place.batch, end) + place.lane;
  for (int row = 0; row < kTerminalSize; ++row) {
    for (int column = 0; column < kJointSize; ++column)
      target[(row * kJointSize + column) * kChainLanes] = jacobian(row, column);
  }
}

void CondensedMatrix::add(double factor, const CondensedMatrix& matrix) {
  LIMBER_DEMAND(matrix.structure_ == structure_);
  for (std::size_t i = 0; i < band_.size(); ++i)
    for (int lane = 0; lane < kChainLanes; ++lane)
      band_[i].values[lane] += factor * matrix.band_[i].values[lane];
  for (std::size_t i = 0; i < joints_.size(); ++i) joints_[i] += factor * matrix.joints_[i];
}

void CondensedMatrix::multiply(const Eigen::Ref<const Eigen::VectorXd>& x,
                               Eigen::Ref<Eigen::VectorXd> y) const {
  LIMBER_DEMAND(x.size() == structure_->size() && y.size() == x.size());
  y.setZero();
  Eigen::VectorXd v, w;
  for (int c = 0; c < static_cast<int>(structure_->chains().size()); ++c) {
    const ChainMap map(*this, c);
    v.setZero(map.numbers());
    w.setZero(map.numbers());
    for (int i = 0; i < map.numbers(); ++i)
      map.unknowns(i, [&](int unknown, double factor) { v[i] += factor * x[unknown]; });
    for (int j = 0; j < map.numbers(); ++j) {
      w[j] += map.entry(j, j) * v[j];
      for (int i = j + 1; i < std::min<std::ptrdiff_t>(j + kBandHeight, map.numbers()); ++i) {
        w[i] += map.entry(i, j) * v[j];
        w[j] += map.entry(i, j) * v[i];
      }
    }
    for (int i = 0; i < map.numbers(); ++i)
      map.unknowns(i, [&](int unknown, double factor) { y[unknown] += factor * w[i]; });
  }
  for (int j = 0; j < structure_->joints(); ++j) {
    const Eigen::Map<const Eigen::Matrix<double, 9, 9>> block(joint(j));
    y.segment<9>(structure_->joint_begin(j)) +=
        block.selfadjointView<Eigen::Lower>() * x.segment<9>(structure_->joint_begin(j));
  }
}

Eigen::SparseMatrix<double> CondensedMatrix::to_sparse() const {
  std::vector<Eigen::Triplet<double>> triplets;
  for (int c = 0; c < static_cast<int>(structure_->chains().size()); ++c) {
    const ChainMap map(*this, c);
    const auto add = [&](int i, int j, double value) {
      map.unknowns(i, [&](int row, double left) {
        map.unknowns(j, [&](int column, double right) {
          triplets.emplace_back(row, column, left * value * right);
        });
      });
    };
    for (int j = 0; j < map.numbers(); ++j) {
      add(j, j, map.entry(j, j));
      for (int i = j + 1; i < std::min<std::ptrdiff_t>(j + kBandHeight, map.numbers()); ++i) {
        add(i, j, map.entry(i, j));
        add(j, i, map.entry(i, j));
      }
    }
  }
  for (int j = 0; j < structure_->joints(); ++j) {
    const int begin = structure_->joint_begin(j);
    for (int column = 0; column < 9; ++column) {
      for (int row = 0; row < 9; ++row) {
        triplets.emplace_back(begin + row, begin + column,
                              joint(j)[std::min(row, column) * 9 + std::max(row, column)]);
      }
    }
  }
  Eigen::SparseMatrix<double> result(structure_->size(), structure_->size());
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

}  // namespace limber::rods
