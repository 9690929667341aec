#pragma once

#include <memory>

#include "engine/rods/rod/rod_state.h"
#include "engine/rods/section/section.h"

namespace limber::rods {

enum class RestShape { kStraight, kAsDrawn };

struct RodOptions {
  RestShape rest = RestShape::kAsDrawn;  // straight: edges keep their lengths, all strains vanish
  BendingForm form = BendingForm::kMaterialFrames;
  /// d1 of the first edge: made orthogonal to it and unit; zero leaves the choice here.
  Eigen::Vector3d first_director = Eigen::Vector3d::Zero();
};

/// One rod of uniform section through the nodes of a polyline, frames without twist along it.
/// Curvatures of a rod live at interior nodes, each for half of both edges there; what clamps an
/// end by holding its edge therefore clamps the rod in the middle of that edge.
struct Rod {
  /// @param nodes  3 x (edges + 1)
  /// @throws Error{kInvalidArgument} as SourceFrames, RodParameters::validate
  Rod(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const SectionStiffness& stiffness,
      const RodOptions& options = {});

  [[nodiscard]] int edges() const { return layout->edges(0); }

  std::shared_ptr<const RodLayout> layout;
  RodParameters parameters;
  RodState drawn;  // at the given nodes, all angles zero
};

}  // namespace limber::rods
