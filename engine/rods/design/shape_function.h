#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// A number by which a shape is judged, f = share E + r(x). Derivatives of the elastic energy E are
/// left to the owner of a factored Hessian; r depends on the shape alone. Derivatives are by
/// increments of the unknowns from the state.
class ShapeFunction {
 public:
  ShapeFunction() = default;
  ShapeFunction(const ShapeFunction&) = delete;
  ShapeFunction& operator=(const ShapeFunction&) = delete;
  virtual ~ShapeFunction() = default;

  /// f, all of it.
  [[nodiscard]] virtual double value(const LinkageState& state) = 0;
  [[nodiscard]] virtual double elastic_share() const { return 0; }
  /// by += weight dr/dx
  virtual void add_gradient(const LinkageState& state, double weight,
                            Eigen::Ref<Eigen::VectorXd> by) = 0;
  /// by += weight D^2 r[v, .]
  virtual void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                          double weight, Eigen::Ref<Eigen::VectorXd> by) = 0;
};

}  // namespace limber::rods
