#pragma once

#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// A number by which a shape is judged. It may depend on rest lengths and sections too, as the
/// elastic energy does. Derivatives are by increments of the unknowns from the state, by rest
/// lengths and by sections; those by edges and by sections may be left empty: zero.
class ShapeFunction {
 public:
  ShapeFunction() = default;
  ShapeFunction(const ShapeFunction&) = delete;
  ShapeFunction& operator=(const ShapeFunction&) = delete;
  virtual ~ShapeFunction() = default;

  [[nodiscard]] virtual double value(const LinkageState& state) = 0;
  [[nodiscard]] virtual LinkageVector gradient(const LinkageState& state) = 0;
  /// D^2 f[v, .]; v has its unknowns.
  [[nodiscard]] virtual LinkageVector second(const LinkageState& state, const LinkageVector& v) = 0;
};

}  // namespace limber::rods
