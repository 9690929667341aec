#include "engine/reduced/layered_kinematics.h"

#include <utility>

#include "engine/base/error.h"

namespace limber::reduced {

LayeredKinematics::LayeredKinematics(std::shared_ptr<ReducedKinematics> reduced)
    : reduced_(std::move(reduced)) {}

SiteId LayeredKinematics::add_site(const std::vector<int>& nodes) {
  const SiteId site = reduced_->add_site(nodes);
  if (site < static_cast<SiteId>(sites_.size())) return site;
  sites_.push_back(nodes);
  if (shift_) rows_.push_back(rows_of(nodes));
  return site;
}

void LayeredKinematics::set_full(std::unique_ptr<FullKinematics> full) {
  full_ = std::move(full);
  sites_in_full_ = 0;
}

void LayeredKinematics::use(Level level) {
  LIMBER_DEMAND(level == Level::kReduced || full_ != nullptr);
  level_ = level;
  if (level == Level::kReduced) return;
  for (; sites_in_full_ < sites_.size(); ++sites_in_full_) {
    const SiteId site = full_->add_site(sites_[sites_in_full_]);
    LIMBER_DEMAND(site == static_cast<SiteId>(sites_in_full_));
  }
}

void LayeredKinematics::set_shift(std::shared_ptr<const FrameShift> shift) {
  shift_ = std::move(shift);
  rows_.clear();
  if (!shift_) return;
  for (const std::vector<int>& nodes : sites_) rows_.push_back(rows_of(nodes));
}

LayeredKinematics::Rows LayeredKinematics::rows_of(const std::vector<int>& nodes) const {
  Rows rows = Rows::Zero(3, shift_->basis->cols());
  for (const int node : nodes) rows += shift_->basis->middleRows<3>(3 * Eigen::Index{node});
  return rows / static_cast<double>(nodes.size());
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
  if (!shift_) return;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (!reduced_->moves(queries[i].site)) continue;
    const int frame = frames[static_cast<std::size_t>(queries[i].column)];
    u.col(static_cast<Eigen::Index>(i)) +=
        rows_[static_cast<std::size_t>(queries[i].site)] * shift_->shift.col(frame).cast<double>();
  }
}

void LayeredKinematics::curvature(std::span<const int> frames,
                                  const Eigen::Ref<const Eigen::MatrixXd>& z,
                                  std::span<const SiteQuery> queries,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                                  Eigen::MatrixXd& out) const {
  if (level_ == Level::kFull) return full_->curvature(frames, z, queries, multipliers, out);
  reduced_->curvature(frames, z, queries, multipliers, out);
}

}  // namespace limber::reduced
