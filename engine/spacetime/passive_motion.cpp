#include "engine/spacetime/passive_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/spacetime/banded_factor.h"
#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/run_elimination.h"

namespace limber::spacetime {
namespace {

/// The step's proximal term; further steps remove its effect.
constexpr double kPassiveProximal = 1e-10;
constexpr int kPassiveSteps = 4;

/// A over the free frames, and B g, a row each.
struct Forces {
  std::vector<BandedRow> rows;
  Lanes load;         // lanes x rows
  double beyond = 0;  // 1/2 |B g|^2 of rows that reach no free frame
};

/// B g as the rows of A have their forces: row i holds those of frames i + 1 and, smoothed, i + 2.
Eigen::VectorXd smoothed_load(const ForceRows& force_rows, const ForceSmoothing& smoothing,
                              const Timeline& timeline,
                              const Eigen::Ref<const Eigen::MatrixXd>& load, int row,
                              const Eigen::VectorXd& roots) {
  const int frames = timeline.frame_count;
  const auto of = [&](int frame) -> Eigen::VectorXd {
    if (timeline.is_cyclic()) return load.col((frame % frames + frames) % frames);
    if (frame < 1 || frame > frames - 2) return Eigen::VectorXd::Zero(load.rows());
    return load.col(frame);
  };
  if (force_rows.reach() == 2) return roots.cwiseProduct(of(row + 1));
  return roots.cwiseProduct(smoothing.own * of(row + 1) + smoothing.following * of(row + 2));
}

Forces forces_of(const ModeDynamics& dynamics, const Timeline& timeline,
                 const Eigen::Ref<const Eigen::MatrixXd>& load) {
  const ForceRows force_rows(dynamics, timeline.frame_count, beginning_of(timeline));
  const FreeFrames free(timeline);
  const ForceSmoothing smoothing(dynamics.smoothing);
  const int reach = force_rows.reach(), lanes = force_rows.lanes();
  Eigen::VectorXd roots(load.rows());
  for (Eigen::Index k = 0; k < roots.size(); ++k) roots[k] = std::sqrt(dynamics.force_weight(k));
  Forces forces;
  forces.load = Lanes::Zero(lanes, force_rows.last() - force_rows.first() + 1);
  Eigen::VectorXd of_row(load.rows());
  for (int row = force_rows.first(); row <= force_rows.last(); ++row) {
    const int begin = std::max(row, free.first());
    BandedRow made{begin - free.first(), Lanes::Zero(lanes, 2 * reach)};
    const bool is_over_seam = free.is_cyclic() && row + reach >= free.frame_count();
    if (is_over_seam) {
      made.start = 0;
      made.behind = Lanes::Zero(lanes, reach);
    }
    for (int term = 0; term <= reach; ++term) {
      const int frame = row + term;
      if (!free.contains(frame)) continue;
      auto column = !is_over_seam ? made.values.col(frame - begin)
                    : frame >= free.frame_count()
                        ? made.values.col(frame - free.frame_count())
                        : made.behind.col(frame - free.frame_count() + reach);
      column += Eigen::Map<const Eigen::VectorXd>(force_rows.coefficient(row, term), lanes);
    }
    // Rows of what sampled modes begin with have no force.
    if (free.is_cyclic() || row >= 2 - reach) {
      of_row = smoothed_load(force_rows, smoothing, timeline, load, row, roots);
    } else {
      of_row.setZero();
    }
    if (!is_over_seam && begin > std::min(free.last(), row + reach)) {
      forces.beyond += 0.5 * of_row.squaredNorm();
      continue;
    }
    forces.load.col(static_cast<Eigen::Index>(forces.rows.size())).head(load.rows()) = of_row;
    forces.rows.push_back(std::move(made));
  }
  forces.load.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(forces.rows.size()));
  return forces;
}

}  // namespace

PassiveMotion passive_motion(const ModeDynamics& dynamics, const Timeline& timeline,
                             const Eigen::Ref<const Eigen::MatrixXd>& load) {
  LIMBER_DEMAND(load.rows() == dynamics.stiffness.size() && load.cols() == timeline.frame_count);
  Forces forces = forces_of(dynamics, timeline, load);
  const FreeFrames free(timeline);
  const Eigen::Index lanes = forces.load.rows();
  const auto count = static_cast<Eigen::Index>(forces.rows.size());
  Lanes z = Lanes::Zero(lanes, free.count()), product, step;
  Lanes right = Lanes::Zero(lanes, free.count());
  for (Eigen::Index i = 0; i < count; ++i) {
    const BandedRow& row = forces.rows[static_cast<std::size_t>(i)];
    const auto width_here = std::min<Eigen::Index>(row.values.cols(), free.count() - row.start);
    const auto by = forces.load.col(i).array();
    right.middleCols(row.start, width_here) +=
        (row.values.leftCols(width_here).array().colwise() * by).matrix();
    if (row.behind.size() > 0)
      right.rightCols(row.behind.cols()) += (row.behind.array().colwise() * by).matrix();
  }
  std::stable_sort(forces.rows.begin(), forces.rows.end(),
                   [](const BandedRow& a, const BandedRow& b) { return a.start < b.start; });
  const int width = static_cast<int>(forces.rows[0].values.cols());
  BandedFactor factor;
  factor.factor(forces.rows, width, free.count(), static_cast<int>(lanes), kPassiveProximal,
                free.is_cyclic() ? Shape::kCycle : Shape::kBand);
  for (int i = 0; i < kPassiveSteps; ++i) {
    apply_normal(forces.rows, z, product);
    step = right - product;
    factor.solve(step);
    z += step;
  }
  PassiveMotion passive;
  passive.z = Eigen::MatrixXd::Zero(load.rows(), timeline.frame_count);
  passive.z.middleCols(free.first(), free.count()) = z.topRows(load.rows());
  // 1/2 |A z - B g|^2 = 1/2 |B g|^2 - 1/2 z^T A^T B g where the gradient vanishes.
  passive.energy =
      forces.beyond +
      std::max(0.0, 0.5 * (forces.load.topRows(load.rows()).squaredNorm() -
                           z.topRows(load.rows()).cwiseProduct(right.topRows(load.rows())).sum()));
  return passive;
}

}  // namespace limber::spacetime
