#include "tests/support/single_rod.h"

#include <string>

#include "engine/base/error.h"

namespace limber::rods {

namespace {

std::shared_ptr<const RodLayout> layout_of(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  if (nodes.cols() < 2) {
    throw Error(ErrorCode::kInvalidArgument, "rod.nodes",
                "a rod needs two nodes, got " + std::to_string(nodes.cols()));
  }
  return std::make_shared<const RodLayout>(std::vector<int>{static_cast<int>(nodes.cols()) - 1});
}

RodState drawn_state(const std::shared_ptr<const RodLayout>& layout,
                     const Eigen::Ref<const Eigen::Matrix3Xd>& nodes,
                     const Eigen::Vector3d& first_director) {
  Eigen::VectorXd unknowns = Eigen::VectorXd::Zero(layout->unknowns());
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) unknowns.segment<3>(4 * i) = nodes.col(i);
  return {layout,
          std::make_shared<const SourceFrames>(
              SourceFrames::without_twist(*layout, unknowns, Eigen::Matrix3Xd(first_director))),
          unknowns};
}

}  // namespace

Rod::Rod(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const SectionStiffness& stiffness,
         const RodOptions& options)
    : layout(layout_of(nodes)),
      parameters(*layout),
      drawn(drawn_state(layout, nodes, options.first_director)) {
  using P = RodParameters;
  parameters.form = options.form;
  drawn.set_as_rest(parameters);
  for (int slot = 0; slot < layout->nodes(); ++slot) {
    if (layout->is_edge(slot)) parameters(slot, P::kStretching) = stiffness.stretching;
    if (!layout->is_interior(slot)) continue;
    parameters(slot, P::kBending1) = stiffness.bending_1;
    parameters(slot, P::kBending2) = stiffness.bending_2;
    parameters(slot, P::kTorsion) = stiffness.torsion;
    if (options.rest == RestShape::kAsDrawn) continue;
    for (const auto p :
         {P::kRestBefore1, P::kRestBefore2, P::kRestAfter1, P::kRestAfter2, P::kRestTwist})
      parameters(slot, p) = 0;
  }
  parameters.validate(*layout);
}

}  // namespace limber::rods
