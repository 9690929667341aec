#include <deque>

#include "engine/base/error.h"
#include "engine/reduced/base_frames.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"
#include "engine/reduced/site_list.h"
#include "tests/support/reconstruction.h"

namespace limber::reduced {
namespace {

/// Full RS: every tet is a cubature tet, and the basis of a site is its own row.
class FullRsReconstruction final : public Reconstruction {
 public:
  FullRsReconstruction(const bodies::ElasticBody& body, const ScaledModes& modes,
                       const Eigen::MatrixXd& base, const JobContext& job)
      : full_(body),
        modes_(modes.modes),
        length_(body.length()),
        base_(base, body.mesh.node_count()),
        sites_(body.mesh.node_count()) {
    const bodies::GradientOperator& gradient = full_.gradient();
    BaseMotion motion;
    if (base_.any()) {
      motion.rs.resize(kRsSize * Eigen::Index{gradient.tet_count()}, base.cols());
      const RsInverse inverse(body, gradient);
      RsTrack track;
      for (Eigen::Index frame = 0; frame < base.cols(); ++frame) {
        job.report("base motion", static_cast<double>(frame) / static_cast<double>(base.cols()));
        motion.rs.col(frame) = inverse.coordinates(base.col(frame), track);
      }
    }
    for (int e = 0; e < gradient.tet_count(); ++e) site_.tets.push_back(e);
    site_.rs_modes = linear_coordinates(gradient, modes_);
    tangent_ = TangentTables(site_, base_.any() ? &motion : nullptr);
    site_.rs_modes.resize(0, 0);
    base_rs_ = std::move(motion.rs);
    if (full_.mass_share().size() > 0) centre_ = mean(modes_);
  }

  SiteId add_site(const std::vector<int>& nodes) override {
    const SiteList::Added added = sites_.add(nodes);
    if (!added.is_new) return added.id;
    const Eigen::Matrix3Xd row = full_.row_of({nodes, {}});
    site_.map = Eigen::MatrixXd::Zero(3, kRsSize * row.cols());
    for (Eigen::Index e = 0; e < row.cols(); ++e) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) site_.map(i, kRsSize * e + 3 * j + i) = row(j, e);
      }
    }
    site_.direct = centre_.size() > 0 ? centre_ : Eigen::MatrixXd::Zero(3, modes_.cols());
    tables_.emplace_back(site_, tangent_, Eigen::MatrixXd::Identity(3, 3));
    return added.id;
  }

  [[nodiscard]] int coordinate_count() const override { return static_cast<int>(modes_.cols()); }
  [[nodiscard]] double length() const override { return length_; }
  [[nodiscard]] bool moves(SiteId site) const override {
    sites_.check(site);
    return !tables_[site].map.isZero(0) || !tables_[site].direct.isZero(0);
  }

  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    thread_local TangentWorkspace work;
    begin(work, frames, z, queries);
    work.evaluate(tangent_, frames, z, jacobian != nullptr);
    const auto count = static_cast<Eigen::Index>(queries.size());
    u.resize(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const SiteQuery& query = queries[i];
      const SiteTables& site = tables_[query.site];
      u.col(i) =
          site.map * work.gradient(work.slot[query.column]) + site.direct * z.col(query.column);
      if (base_.any()) u.col(i) += base_centre(frames[query.column]);
    }
    if (jacobian == nullptr) return;
    jacobian->resize(3 * count, modes_.cols());
    work.chain.resize(3 * count, tangent_.rows());
    for (Eigen::Index i = 0; i < count; ++i) {
      jacobian->middleRows<3>(3 * i) = tables_[queries[i].site].direct;
      work.chain_rows(tangent_, tables_[queries[i].site], work.slot[queries[i].column], 3 * i);
    }
    jacobian->noalias() += work.chain * tangent_.rs_modes;
  }

  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const override {
    thread_local TangentWorkspace work;
    thread_local CurvatureWorkspace second;
    begin(work, frames, z, queries);
    work.evaluate(tangent_, frames, z, false);
    const Eigen::Index size = modes_.cols();
    out.setZero(size, size * z.cols());
    for (const int column : work.columns) {
      second.force.setZero(tangent_.rows());
      for (std::size_t i = 0; i < queries.size(); ++i) {
        if (queries[i].column != column) continue;
        second.force.noalias() += tables_[queries[i].site].map.transpose() *
                                  multipliers.col(static_cast<Eigen::Index>(i));
      }
      second.add_tets(tangent_.padded, work.y.col(work.slot[column]).data(), second.force.data());
      second.multiply(tangent_);
      auto block = out.middleCols(size * column, size);
      block.noalias() = tangent_.rs_modes.transpose() * second.product;
      block = (0.5 * (block + block.transpose())).eval();
    }
  }

  [[nodiscard]] Eigen::MatrixXd displacements(
      int first, const Eigen::Ref<const Eigen::MatrixXd>& z) const override {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    base_.check(first, z.cols());
    if (!base_.any()) return full_.from_linear(modes_ * z);
    constexpr Eigen::Index kFrames = 16;
    Eigen::MatrixXd u(modes_.rows(), z.cols());
    for (Eigen::Index from = 0; from < z.cols(); from += kFrames) {
      const Eigen::Index count = std::min(kFrames, z.cols() - from);
      const Eigen::MatrixXd y =
          linear_coordinates(full_.gradient(), modes_ * z.middleCols(from, count)) +
          base_rs_.middleCols(first + from, count);
      u.middleCols(from, count) = full_.from_coordinates(y);
      for (Eigen::Index i = 0; i < count; ++i) {
        Eigen::Vector3d shift = base_centre(first + static_cast<int>(from + i));
        if (centre_.size() > 0) shift += centre_ * z.col(from + i);
        Eigen::Map<Eigen::Matrix3Xd>(u.col(from + i).data(), 3, u.rows() / 3).colwise() += shift;
      }
    }
    return u;
  }

 private:
  void begin(TangentWorkspace& work, std::span<const int> frames,
             const Eigen::Ref<const Eigen::MatrixXd>& z, std::span<const SiteQuery> queries) const {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    sites_.check(queries, z.cols());
    base_.check(frames);
    work.begin(tangent_, z, queries);
  }

  /// Mass-weighted mean of fields (3n x k), 3 x k.
  [[nodiscard]] Eigen::MatrixXd mean(const Eigen::MatrixXd& fields) const {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3, fields.cols());
    for (Eigen::Index i = 0; i < full_.mass_share().size(); ++i)
      result += full_.mass_share()[i] * fields.middleRows<3>(3 * i);
    return result;
  }
  [[nodiscard]] Eigen::Vector3d base_centre(int frame) const {
    if (centre_.size() == 0) return Eigen::Vector3d::Zero();
    return mean(base_.displacements().col(frame));
  }

  FullReconstruction full_;
  Eigen::MatrixXd modes_;
  double length_;
  BaseFrames base_;
  SiteList sites_;
  ReducedModel site_;  // only what TangentTables and SiteTables read: tets, map, direct
  TangentTables tangent_;
  std::deque<SiteTables> tables_;
  Eigen::MatrixXd base_rs_;  // 9m x N, or empty
  Eigen::MatrixXd centre_;   // 3 x R, motion of a free body's centre of mass; else empty
};

class ReducedReconstruction final : public Reconstruction {
 public:
  ReducedReconstruction(std::shared_ptr<const ReducedModel> model,
                        std::shared_ptr<const BaseMotion> base)
      : model_(model), kinematics_(std::move(model), std::move(base)) {}

  SiteId add_site(const std::vector<int>& nodes) override { return kinematics_.add_site(nodes); }
  [[nodiscard]] int coordinate_count() const override { return kinematics_.coordinate_count(); }
  [[nodiscard]] double length() const override { return kinematics_.length(); }
  [[nodiscard]] bool moves(SiteId site) const override { return kinematics_.moves(site); }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    kinematics_.evaluate(frames, z, queries, u, jacobian);
  }
  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const override {
    kinematics_.curvature(frames, z, queries, multipliers, out);
  }
  [[nodiscard]] Eigen::MatrixXd displacements(
      int first, const Eigen::Ref<const Eigen::MatrixXd>& z) const override {
    Eigen::MatrixXf q;
    kinematics_.coordinates(first, z, q);
    return model_->basis * q.cast<double>();
  }

 private:
  std::shared_ptr<const ReducedModel> model_;
  ReducedKinematics kinematics_;
};

}  // namespace

std::unique_ptr<Reconstruction> make_full_reconstruction(const bodies::ElasticBody& body,
                                                         const ScaledModes& modes,
                                                         const Eigen::MatrixXd& base,
                                                         const JobContext& job) {
  return std::make_unique<FullRsReconstruction>(body, modes, base, job);
}

std::unique_ptr<Reconstruction> make_reduced_reconstruction(
    std::shared_ptr<const ReducedModel> model, std::shared_ptr<const BaseMotion> base) {
  LIMBER_DEMAND(model != nullptr);
  return std::make_unique<ReducedReconstruction>(std::move(model), std::move(base));
}

}  // namespace limber::reduced
