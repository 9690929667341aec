#include "engine/base/error.h"
#include "engine/reduced/base_frames.h"
#include "engine/reduced/site_list.h"
#include "tests/support/reconstruction.h"

namespace limber::reduced {
namespace {

class LinearReconstruction final : public Reconstruction {
 public:
  LinearReconstruction(const bodies::ElasticBody& body, const ScaledModes& modes,
                       const Eigen::MatrixXd& base)
      : modes_(modes.modes),
        length_(body.length()),
        base_(base, body.mesh.node_count()),
        sites_(body.mesh.node_count()) {
    LIMBER_DEMAND(modes_.rows() == 3 * Eigen::Index{body.mesh.node_count()});
  }

  SiteId add_site(const std::vector<int>& nodes) override {
    const SiteList::Added added = sites_.add(nodes);
    if (!added.is_new) return added.id;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, modes_.cols());
    for (const int node : nodes) rows += modes_.middleRows<3>(3 * Eigen::Index{node});
    rows_.push_back(rows / static_cast<double>(nodes.size()));
    return added.id;
  }

  [[nodiscard]] int coordinate_count() const override { return static_cast<int>(modes_.cols()); }
  [[nodiscard]] double length() const override { return length_; }
  [[nodiscard]] bool moves(SiteId site) const override {
    sites_.check(site);
    return !rows_[site].isZero(0);
  }

  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    sites_.check(queries, z.cols());
    base_.check(frames);
    const auto count = static_cast<Eigen::Index>(queries.size());
    u.resize(3, count);
    if (jacobian != nullptr) jacobian->resize(3 * count, modes_.cols());
    for (Eigen::Index i = 0; i < count; ++i) {
      const SiteQuery& query = queries[i];
      u.col(i) = rows_[query.site] * z.col(query.column);
      if (base_.any()) u.col(i) += base_.mean(sites_.nodes(query.site), frames[query.column]);
      if (jacobian != nullptr) jacobian->middleRows<3>(3 * i) = rows_[query.site];
    }
  }

  void curvature(std::span<const int>, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries, const Eigen::Ref<const Eigen::Matrix3Xd>&,
                 Eigen::MatrixXd& out) const override {
    sites_.check(queries, z.cols());
    out.setZero(z.rows(), z.rows() * z.cols());
  }

  [[nodiscard]] Eigen::MatrixXd displacements(
      int first, const Eigen::Ref<const Eigen::MatrixXd>& z) const override {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    Eigen::MatrixXd u = modes_ * z;
    base_.add_to(first, u);
    return u;
  }

 private:
  Eigen::MatrixXd modes_;
  double length_;
  BaseFrames base_;
  SiteList sites_;
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> rows_;
};

}  // namespace

std::unique_ptr<Reconstruction> make_linear_reconstruction(const bodies::ElasticBody& body,
                                                           const ScaledModes& modes,
                                                           const Eigen::MatrixXd& base) {
  return std::make_unique<LinearReconstruction>(body, modes, base);
}

}  // namespace limber::reduced
