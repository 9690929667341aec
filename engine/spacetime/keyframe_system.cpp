#include "engine/spacetime/keyframe_system.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/constraint_system.h"

namespace limber::spacetime {

void KeyframeSystem::factor(const ModeSystems& systems, const ConstraintRows& rows) {
  Eigen::VectorXd weights = rows.keyframe_weights();
  if (known_ && weights.size() == weights_.size() && weights == weights_) return;
  weights_ = std::move(weights);
  if (rows.keyframe_blocks().empty()) {
    form_ = Form::kPlain;
  } else if (rows.mixing().size() == 0) {
    form_ = Form::kDiagonal;
    factor_diagonal(systems, rows);
  } else {
    form_ = Form::kBlocks;
    factor_blocks(systems, rows);
  }
  known_ = true;
}

/// A row of one number is rotated into R without a sum of large and small ones, however heavy it
/// is. No digits of K at the neighbouring frames are lost.
void KeyframeSystem::factor_diagonal(const ModeSystems& systems, const ConstraintRows& rows) {
  std::vector<BandedRow> all;
  all.reserve(systems.rows().size() + rows.keyframe_blocks().size());
  for (const TermBlock& block : rows.keyframe_blocks()) {
    BandedRow row{systems.kept_of_knot(block.knot), Lanes::Zero(systems.lanes(), systems.width())};
    row.values.col(0).setConstant(std::sqrt(weights_[block.knot]));
    all.push_back(std::move(row));
  }
  all.insert(all.end(), systems.rows().begin(), systems.rows().end());
  std::stable_sort(all.begin(), all.end(),
                   [](const BandedRow& a, const BandedRow& b) { return a.start < b.start; });
  band_.factor(all, systems.width(), systems.kept_count(), systems.lanes(), ModeSystems::kProximal,
               systems.shape());
  std::vector<int> frames;
  for (const TermBlock& block : rows.position_blocks())
    frames.push_back(systems.kept_of_knot(block.knot));
  green_.compute(band_, systems.kept_count(), systems.lanes(), frames);
}

/// If S is close to singular and a weight is large, rounding may make a block indefinite. The
/// smallest shift that makes it factor is added: one more proximal term, of the step only.
void KeyframeSystem::factor_blocks(const ModeSystems& systems, const ConstraintRows& rows) {
  const Eigen::MatrixXd gram = rows.mixing().transpose() * rows.mixing();
  const double largest = gram.diagonal().maxCoeff();
  const auto factors = [&](double lift) {
    return blocks_.factor(systems, [&](int knot, Eigen::Ref<Eigen::MatrixXd> block) {
      block += weights_[knot] * gram;
      block.diagonal().array() += lift * largest * weights_[knot];
    });
  };
  if (factors(0) || raise_shift(kLifts, factors)) return;
  throw Error(ErrorCode::kNumerical, "", "the keyframes' system cannot be factored");
}

void KeyframeSystem::solve(const ModeSystems& systems, Lanes& x) const {
  switch (form_) {
    case Form::kPlain:
      return systems.solve(x);
    case Form::kDiagonal:
      return band_.solve(x);
    case Form::kBlocks:
      return blocks_.solve(x);
  }
}

void KeyframeSystem::half_response(const ModeSystems& systems, const ConstraintRows& rows,
                                   const Lanes& jacobian) {
  const Eigen::Index modes = systems.modes();
  half_.setZero(modes * systems.kept_count(),
                static_cast<Eigen::Index>(rows.position_places().size()));
  starts_.clear();
  for (const TermBlock& block : rows.position_blocks()) {
    const int kept = systems.kept_of_knot(block.knot);
    const auto column = static_cast<Eigen::Index>(starts_.size());
    half_.block(modes * kept, column, modes, block.count) =
        jacobian.block(0, block.first, modes, block.count);
    starts_.insert(starts_.end(), static_cast<std::size_t>(block.count), kept);
  }
  blocks_.half_solve(half_, starts_);
}

void KeyframeSystem::response(const ModeSystems& systems, const ConstraintRows& rows,
                              const Lanes& jacobian, Eigen::MatrixXd& system) {
  if (form_ == Form::kBlocks) {
    half_response(systems, rows, jacobian);
    system.setZero(half_.cols(), half_.cols());
    system.selfadjointView<Eigen::Lower>().rankUpdate(half_.transpose());
  } else {
    response_of_terms(green(systems), rows.position_blocks(), jacobian, scaled_, system);
  }
  sum_terms(rows.position_places(), static_cast<Eigen::Index>(rows.position_rows().size()), system,
            half_);
}

}  // namespace limber::spacetime
