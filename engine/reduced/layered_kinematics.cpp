#include "engine/reduced/layered_kinematics.h"

#include <utility>

#include "engine/base/error.h"

namespace limber::reduced {
namespace {

using Eigen::Index;

// Share of the anchor's own |z0| at which a correction counts half. Not known to be tuned; it must
// be of the order of the change after which the model has a different error.
constexpr double kReach = 0.5;

}  // namespace

Eigen::VectorXd fading(const Eigen::Ref<const Eigen::MatrixXd>& z,
                       const Eigen::Ref<const Eigen::MatrixXd>& z0) {
  Eigen::VectorXd share(z.cols());
  for (Index i = 0; i < z.cols(); ++i) {
    const double reach = kReach * kReach * z0.col(i).squaredNorm();
    share[i] = reach > 0 ? reach / (reach + (z.col(i) - z0.col(i)).squaredNorm()) : 0;
  }
  return share;
}

struct LayeredKinematics::Correction {
  Eigen::VectorXd away;            // z - z0
  Eigen::Vector3d value;           // a + B away [m]
  const Rows* jacobian = nullptr;  // B; null: 0
  double share = 0;                // phi
  double scale = 0;                // 1 / rho^2
};

LayeredKinematics::LayeredKinematics(std::shared_ptr<ReducedKinematics> reduced)
    : reduced_(std::move(reduced)) {}

SiteId LayeredKinematics::add_site(const Site& site) {
  const SiteId id = reduced_->add_site(site);
  if (id < static_cast<SiteId>(sites_.size())) return id;
  sites_.push_back(site);
  if (shift_) rows_.push_back(mean_rows(*shift_->basis, site));
  return id;
}

void LayeredKinematics::set_full(std::unique_ptr<FullKinematics> full) {
  full_ = std::move(full);
  full_->set_added(added_);
  sites_in_full_ = 0;
}

void LayeredKinematics::set_added(std::shared_ptr<const AddedPoses> added) {
  added_ = std::move(added);
  reduced_->set_added(added_.get());
  if (full_) full_->set_added(added_);
}

void LayeredKinematics::use(Level level) {
  LIMBER_DEMAND(level == Level::kReduced || full_ != nullptr);
  level_ = level;
  if (level == Level::kFull) add_sites_to_full();
}

void LayeredKinematics::heed(const Cancellation& cancellation) {
  LIMBER_DEMAND(full_ != nullptr);
  full_->heed(cancellation);
}

void LayeredKinematics::add_sites_to_full() {
  for (; sites_in_full_ < sites_.size(); ++sites_in_full_) {
    const SiteId site = full_->add_site(sites_[sites_in_full_]);
    LIMBER_DEMAND(site == static_cast<SiteId>(sites_in_full_));
  }
}

void LayeredKinematics::set_shift(std::shared_ptr<const FrameShift> shift) {
  shift_ = std::move(shift);
  rows_.clear();
  if (!shift_) return anchors_.clear();
  for (const Site& site : sites_) rows_.push_back(mean_rows(*shift_->basis, site));
}

LayeredKinematics::Corrections LayeredKinematics::take_corrections() {
  Corrections taken{std::move(shift_), std::move(rows_), std::move(anchors_)};
  set_shift(nullptr);
  return taken;
}

void LayeredKinematics::give_back(Corrections corrections) {
  LIMBER_DEMAND(!corrections.shift || corrections.rows.size() == sites_.size());
  shift_ = std::move(corrections.shift);
  rows_ = std::move(corrections.rows);
  anchors_ = std::move(corrections.anchors);
}

void LayeredKinematics::anchor(std::span<const int> frames,
                               const Eigen::Ref<const Eigen::MatrixXd>& z,
                               std::span<const SiteQuery> queries) {
  add_sites_to_full();
  Eigen::Matrix3Xd full, reduced;
  Eigen::MatrixXd full_jacobian, reduced_jacobian;
  full_->evaluate(frames, z, queries, full, &full_jacobian);
  reduced_->evaluate(frames, z, queries, reduced, &reduced_jacobian);
  anchors_.clear();
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const Eigen::VectorXd pose = z.col(queries[i].column);
    const int frame = frames[static_cast<std::size_t>(queries[i].column)];
    if (!(pose.squaredNorm() > 0)) continue;  // both maps have the same derivative at rest
    anchors_.insert_or_assign(
        std::pair{queries[i].site, frame},
        Anchor{pose, full.col(row) - reduced.col(row),
               full_jacobian.middleRows<3>(3 * row) - reduced_jacobian.middleRows<3>(3 * row)});
  }
}

bool LayeredKinematics::correct(SiteId site, int frame, const Eigen::Ref<const Eigen::VectorXd>& z,
                                Correction& correction) const {
  if (!reduced_->moves(site)) return false;
  const auto found = anchors_.find({site, frame});
  const bool is_anchored = found != anchors_.end();
  if (!is_anchored && (!shift_ || !(shift_->poses.col(frame).squaredNorm() > 0))) return false;
  const Eigen::Ref<const Eigen::VectorXd> pose =
      is_anchored ? Eigen::Ref<const Eigen::VectorXd>(found->second.pose)
                  : Eigen::Ref<const Eigen::VectorXd>(shift_->poses.col(frame));
  correction.away = z - pose;
  correction.scale = 1 / (kReach * kReach * pose.squaredNorm());
  correction.share = 1 / (1 + correction.scale * correction.away.squaredNorm());
  if (is_anchored) {
    correction.jacobian = &found->second.jacobian;
    correction.value = found->second.value + found->second.jacobian * correction.away;
  } else {
    correction.jacobian = nullptr;
    correction.value =
        rows_[static_cast<std::size_t>(site)] * shift_->shift.col(frame).cast<double>();
  }
  return true;
}

int LayeredKinematics::coordinate_count() const { return reduced_->coordinate_count(); }

double LayeredKinematics::length() const { return reduced_->length(); }

bool LayeredKinematics::moves(SiteId site) const { return reduced_->moves(site); }

void LayeredKinematics::evaluate(std::span<const int> frames,
                                 const Eigen::Ref<const Eigen::MatrixXd>& z,
                                 std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                                 Eigen::MatrixXd* jacobian) const {
  if (level_ == Level::kFull) return full_->evaluate(frames, z, queries, u, jacobian);
  reduced_->evaluate(frames, z, queries, u, jacobian);
  if (!shift_ && anchors_.empty()) return;
  Correction at;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto [site, column] = queries[i];
    const int frame = frames[static_cast<std::size_t>(column)];
    if (!correct(site, frame, z.col(column), at)) continue;
    u.col(static_cast<Index>(i)) += at.share * at.value;
    if (jacobian == nullptr) continue;
    auto rows = jacobian->middleRows<3>(3 * static_cast<Index>(i));
    if (at.jacobian != nullptr) rows += at.share * *at.jacobian;
    rows -= (2 * at.scale * at.share * at.share) * at.value * at.away.transpose();
  }
}

void LayeredKinematics::curvature(std::span<const int> frames,
                                  const Eigen::Ref<const Eigen::MatrixXd>& z,
                                  std::span<const SiteQuery> queries,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                                  Eigen::MatrixXd& out) const {
  if (level_ == Level::kFull) return full_->curvature(frames, z, queries, multipliers, out);
  reduced_->curvature(frames, z, queries, multipliers, out);
  if (!shift_ && anchors_.empty()) return;
  const Index size = z.rows();
  Correction at;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto [site, column] = queries[i];
    if (!correct(site, frames[static_cast<std::size_t>(column)], z.col(column), at)) continue;
    // Second derivative of phi(d) m . (a + B d).
    const auto multiplier = multipliers.col(static_cast<Index>(i));
    const double along = multiplier.dot(at.value);
    const double first = -2 * at.scale * at.share * at.share;
    const double second = 8 * at.scale * at.scale * at.share * at.share * at.share;
    auto block = out.middleCols(column * size, size);
    if (at.jacobian != nullptr) {
      const Eigen::VectorXd pull = at.jacobian->transpose() * multiplier;
      block += first * (at.away * pull.transpose() + pull * at.away.transpose());
    }
    block += (along * second) * at.away * at.away.transpose();
    block.diagonal().array() += along * first;
  }
}

}  // namespace limber::reduced
