#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>

#include "engine/reduced/kinematics.h"

namespace limber::testing {

/// Two links of half a body in a plane, turned by one angle each: nothing beyond its length is in
/// reach, and at full stretch the Jacobian loses a row.
class TwoLinkArm final : public reduced::Kinematics {
 public:
  [[nodiscard]] int coordinate_count() const override { return 2; }
  [[nodiscard]] double length() const override { return 1; }
  void evaluate(std::span<const int> /*frames*/, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    const auto count = static_cast<Eigen::Index>(queries.size());
    u.setZero(3, count);
    if (jacobian != nullptr) jacobian->setZero(3 * count, 2);
    for (Eigen::Index i = 0; i < count; ++i) {
      const int column = queries[static_cast<std::size_t>(i)].column;
      const double a = z(0, column), b = a + z(1, column);
      u.col(i) << 0.5 * (std::cos(a) + std::cos(b)) - 1, 0.5 * (std::sin(a) + std::sin(b)), 0;
      if (jacobian == nullptr) continue;
      jacobian->row(3 * i) << -0.5 * (std::sin(a) + std::sin(b)), -0.5 * std::sin(b);
      jacobian->row(3 * i + 1) << 0.5 * (std::cos(a) + std::cos(b)), 0.5 * std::cos(b);
    }
  }
};

}  // namespace limber::testing
