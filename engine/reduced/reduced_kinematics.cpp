#include <fmt/format.h>

#include <deque>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/reduced/added_poses.h"
#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/site_list.h"

namespace limber::reduced {

class ReducedKinematics::Impl {
 public:
  Impl(std::shared_ptr<const ReducedModel> model, std::shared_ptr<const BaseMotion> base)
      : model_(std::move(model)),
        scene_base_(std::move(base)),
        base_(scene_base_),
        list_(model_->node_count) {
    if (base_ != nullptr) {
      const Eigen::Index t9 = kRsSize * Eigen::Index{model_->cubature_size()};
      if (base_->rs.rows() != t9 || base_->direct.rows() != model_->basis_size() ||
          base_->rs.cols() != base_->direct.cols()) {
        throw Error(
            ErrorCode::kInvalidArgument, "base_motion",
            fmt::format(
                "base motion is {} x {} and {} x {}, expected {} and {} rows and as many columns",
                base_->rs.rows(), base_->rs.cols(), base_->direct.rows(), base_->direct.cols(), t9,
                model_->basis_size()));
      }
    }
    fill_tables();
  }

  void set_added(const AddedPoses* added) {
    base_ = scene_base_;
    if (added != nullptr) {
      base_ = std::make_shared<const BaseMotion>(with_poses(*model_, scene_base_.get(), *added));
    }
    fill_tables();
  }

  SiteId add_site(const Site& site) {
    const SiteList::Added added = list_.add(site);
    if (!added.is_new) return added.id;
    Eigen::MatrixXd rows = mean_rows(model_->basis, list_.site(added.id));
    // Rows of fixed nodes are zero but for rounding, which would pass for a motion of theirs.
    constexpr double kRounding = 1e-12;
    if (rows.norm() <= kRounding * model_->basis.cwiseAbs().maxCoeff()) rows.setZero();
    sites_.emplace_back(*model_, tangent_, rows);
    return added.id;
  }

  [[nodiscard]] bool moves(SiteId site) const {
    list_.check(site);
    return !sites_[site].basis.isZero(0);
  }

  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const {
    thread_local TangentWorkspace work;
    begin(work, frames, z, queries);
    work.evaluate(tangent_, frames, z, jacobian != nullptr);

    const auto count = static_cast<Eigen::Index>(queries.size());
    u.resize(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const SiteQuery& query = queries[i];
      const SiteTables& site = sites_[query.site];
      u.col(i) =
          site.map * work.gradient(work.slot[query.column]) + site.direct * z.col(query.column);
      if (base_ != nullptr) u.col(i) += site.basis * base_->direct.col(frames[query.column]);
    }
    if (jacobian == nullptr) return;
    jacobian->resize(3 * count, model_->coordinate_count());
    work.chain.resize(3 * count, tangent_.rows());
    for (Eigen::Index i = 0; i < count; ++i) {
      const SiteQuery& query = queries[i];
      const SiteTables& site = sites_[query.site];
      jacobian->middleRows<3>(3 * i) = site.direct;
      work.chain_rows(tangent_, site, work.slot[query.column], 3 * i);
    }
    jacobian->noalias() += work.chain * tangent_.rs_modes;
  }

  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const {
    thread_local TangentWorkspace work;
    thread_local CurvatureWorkspace second;
    begin(work, frames, z, queries);
    work.evaluate(tangent_, frames, z, false);
    const Eigen::Index size = model_->coordinate_count();
    out.setZero(size, size * z.cols());
    for (const int column : work.columns) {
      second.force.setZero(tangent_.rows());
      for (std::size_t i = 0; i < queries.size(); ++i) {
        if (queries[i].column != column) continue;
        second.force.noalias() +=
            sites_[queries[i].site].map.transpose() * multipliers.col(static_cast<Eigen::Index>(i));
      }
      second.add_tets(tangent_.padded, work.y.col(work.slot[column]).data(), second.force.data());
      second.multiply(tangent_);
      auto block = out.middleCols(size * column, size);
      block.template triangularView<Eigen::Lower>() =
          tangent_.rs_modes.transpose() * second.product;
      block.template triangularView<Eigen::StrictlyUpper>() = block.transpose();
    }
  }

  void coordinates(int first, const Eigen::Ref<const Eigen::MatrixXd>& z,
                   Eigen::MatrixXf& q) const {
    LIMBER_DEMAND(z.rows() == model_->coordinate_count());
    if (base_ != nullptr && z.cols() > 0) {
      check_frame(first);
      check_frame(first + static_cast<int>(z.cols()) - 1);
    }
    q.resize(model_->basis_size(), z.cols());
    const std::int64_t blocks = (z.cols() + StreamTables::kBlock - 1) / StreamTables::kBlock;
    // Short motions are done before a second thread would have woken up.
    constexpr std::int64_t kSerialBlocks = 16;
    parallel_for(blocks, std::max<std::int64_t>(kSerialBlocks, 1),
                 [&](std::int64_t begin, std::int64_t end) {
                   thread_local StreamWorkspace work;
                   for (std::int64_t b = begin; b < end; ++b) {
                     const Eigen::Index from = b * StreamTables::kBlock;
                     const Eigen::Index n =
                         std::min<Eigen::Index>(StreamTables::kBlock, z.cols() - from);
                     work.evaluate(stream_, first + static_cast<int>(from), z.middleCols(from, n),
                                   q.middleCols(from, n));
                   }
                 });
  }

  [[nodiscard]] const ReducedModel& model() const { return *model_; }

 private:
  /// Refuses what would be read out of range.
  void begin(TangentWorkspace& work, std::span<const int> frames,
             const Eigen::Ref<const Eigen::MatrixXd>& z, std::span<const SiteQuery> queries) const {
    LIMBER_DEMAND(z.rows() == model_->coordinate_count());
    LIMBER_DEMAND(base_ == nullptr || static_cast<Eigen::Index>(frames.size()) == z.cols());
    list_.check(queries, z.cols());
    work.begin(tangent_, z, queries);
    if (base_ == nullptr) return;
    for (int column : work.columns) check_frame(frames[column]);
  }

  void fill_tables() {
    tangent_ = TangentTables(*model_, base_.get());
    stream_ = StreamTables(*model_, base_.get());
  }

  void check_frame(int frame) const {
    if (frame < 0 || frame >= base_->rs.cols()) {
      throw Error(
          ErrorCode::kOutOfRange, "frames",
          fmt::format("frame {} is not in the base motion's [0, {})", frame, base_->rs.cols()));
    }
  }

  std::shared_ptr<const ReducedModel> model_;
  std::shared_ptr<const BaseMotion> scene_base_;
  std::shared_ptr<const BaseMotion> base_;  // with the added poses
  TangentTables tangent_;
  StreamTables stream_;
  SiteList list_;
  std::deque<SiteTables> sites_;
};

ReducedKinematics::ReducedKinematics(std::shared_ptr<const ReducedModel> model,
                                     std::shared_ptr<const BaseMotion> base)
    : impl_(std::make_unique<Impl>(std::move(model), std::move(base))) {}

ReducedKinematics::~ReducedKinematics() = default;

SiteId ReducedKinematics::add_site(const Site& site) { return impl_->add_site(site); }

void ReducedKinematics::set_added(const AddedPoses* added) { impl_->set_added(added); }

int ReducedKinematics::coordinate_count() const { return impl_->model().coordinate_count(); }

bool ReducedKinematics::moves(SiteId site) const { return impl_->moves(site); }

double ReducedKinematics::length() const { return impl_->model().length; }

void ReducedKinematics::evaluate(std::span<const int> frames,
                                 const Eigen::Ref<const Eigen::MatrixXd>& z,
                                 std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                                 Eigen::MatrixXd* jacobian) const {
  impl_->evaluate(frames, z, queries, u, jacobian);
}

void ReducedKinematics::curvature(std::span<const int> frames,
                                  const Eigen::Ref<const Eigen::MatrixXd>& z,
                                  std::span<const SiteQuery> queries,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                                  Eigen::MatrixXd& out) const {
  impl_->curvature(frames, z, queries, multipliers, out);
}

void ReducedKinematics::coordinates(int first, const Eigen::Ref<const Eigen::MatrixXd>& z,
                                    Eigen::MatrixXf& q) const {
  impl_->coordinates(first, z, q);
}

}  // namespace limber::reduced
