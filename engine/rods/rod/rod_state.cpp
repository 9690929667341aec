#include "engine/rods/rod/rod_state.h"

#include "engine/base/error.h"
#include "engine/rods/rod/rod_passes.h"

namespace limber::rods {

using namespace passes;

namespace {

SlotArray columns_of(const RodLayout& layout, const Eigen::VectorXd& unknowns) {
  SlotArray result = slots(layout, 4);
  result.topRows(layout.nodes()) =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>>(
          unknowns.data(), layout.nodes(), 4);
  return result;
}

}  // namespace

RodState::RodState(std::shared_ptr<const RodLayout> layout,
                   std::shared_ptr<const SourceFrames> source,
                   const Eigen::Ref<const Eigen::VectorXd>& unknowns)
    : layout_(std::move(layout)),
      source_(std::move(source)),
      unknowns_(unknowns),
      unknown_slots_(columns_of(*layout_, unknowns_)),
      frames_(layout_->rows(), static_cast<int>(kFrameFields)),
      twists_(slots(*layout_, 1)) {
  LIMBER_DEMAND(unknowns.size() == layout_->unknowns() &&
                source_->values().rows() == layout_->rows());
  frames_.bottomRows(layout_->rows() - layout_->nodes()).setZero();
  const SlotsIn from{&source_->values(), nullptr}, x{&unknown_slots_, nullptr};
  passes::frames<Lane>(*layout_, from, x, {&frames_, nullptr});
  passes::twists<Lane>(*layout_, from, x, {&frames_, nullptr}, {&twists_, nullptr});
}

MaterialFrame<double> RodState::frame(int slot) const {
  LIMBER_DEMAND(layout_->is_edge(slot));
  const auto vec = [&](int f) {
    return Vec3<double>{frames_(slot, f), frames_(slot, f + 1), frames_(slot, f + 2)};
  };
  return {vec(kTangent), frames_(slot, kLength), vec(kD1), vec(kD2), vec(kTransport)};
}

VertexStrains<double> RodState::strains(int slot, BendingForm form) const {
  LIMBER_DEMAND(layout_->is_interior(slot));
  return vertex_response<VertexOrder::kEnergy>(frame(slot - 1), frame(slot), twists_(slot, 0),
                                               VertexMaterial<double>{}, form)
      .strains;
}

bool RodState::is_finite() const {
  SlotArray flags = slots(*layout_, 1);
  passes::finiteness(*layout_, {&frames_, nullptr}, {&twists_, nullptr}, {&flags, nullptr});
  return (flags.array() == 0).all();
}

RodState::Forces RodState::forces(const RodParameters& parameters) const {
  const RodLayout& layout = *layout_;
  LIMBER_DEMAND(parameters.values().rows() == layout.rows());
  const SlotsIn p{&parameters.values(), nullptr}, f{&frames_, nullptr};
  SlotArray moments = slots(layout, 3), edges = slots(layout, 4);
  Forces result;
  result.energies_by_slot = slots(layout, kEnergyFields);
  passes::vertices<Lane>(layout, p, parameters.form, f, {&twists_, nullptr},
                         {{&moments, nullptr}, {}, &result.energies_by_slot});
  passes::edge_gradients<Lane>(layout, p, f, {&moments, nullptr}, {&edges, nullptr},
                               &result.energies_by_slot);
  result.energies = {result.energies_by_slot.col(kStretchEnergy).sum(),
                     result.energies_by_slot.col(kBendEnergy).sum(),
                     result.energies_by_slot.col(kTwistEnergy).sum()};
  result.gradient = passes::gather(layout, edges);
  return result;
}

RodEnergies RodState::energies(const RodParameters& parameters) const {
  return forces(parameters).energies;
}

Eigen::VectorXd RodState::gradient(const RodParameters& parameters) const {
  return forces(parameters).gradient;
}

void RodState::set_as_rest(RodParameters& parameters) const {
  using P = RodParameters;
  for (int slot = 0; slot < layout_->nodes(); ++slot) {
    if (layout_->is_edge(slot)) parameters(slot, P::kRestLength) = frames_(slot, kLength);
    if (!layout_->is_interior(slot)) continue;
    const auto s = strains(slot, parameters.form);
    parameters(slot, P::kRestBefore1) = s.before_1;
    parameters(slot, P::kRestBefore2) = s.before_2;
    parameters(slot, P::kRestAfter1) = s.after_1;
    parameters(slot, P::kRestAfter2) = s.after_2;
    parameters(slot, P::kRestTwist) = s.twist;
  }
}

RodAtSource::RodAtSource(RodState state) : state_(std::move(state)) {
  if (!state_.is_finite()) {
    throw Error(ErrorCode::kFailedPrecondition, "rod",
                "frames are not finite: an edge has no length or is folded back");
  }
  SlotArray source = slots(*state_.layout_, SourceFrames::kFields);
  passes::sources(*state_.layout_, {&state_.unknown_slots_, nullptr}, {&state_.frames_, nullptr},
                  {&state_.twists_, nullptr}, {&source, nullptr});
  state_.frames_.middleCols(kTransport, 3).setZero();
  state_.source_ = std::make_shared<const SourceFrames>(SourceFrames(std::move(source)));
}

HessianBlocks RodAtSource::hessian(const RodParameters& parameters) const {
  const RodLayout& layout = *state_.layout_;
  LIMBER_DEMAND(parameters.values().rows() == layout.rows());
  const SlotsIn p{&parameters.values(), nullptr}, f{&state_.frames_, nullptr};
  SlotArray moments = slots(layout, 3), stiffnesses = slots(layout, 6);
  SlotArray result(layout.rows(), static_cast<int>(kBlockFields));
  passes::vertices<Lane>(layout, p, parameters.form, f, {&state_.twists_, nullptr},
                         {{&moments, nullptr}, {&stiffnesses, nullptr}, nullptr});
  passes::blocks<Lane, Transport::kNone>(layout, {&state_.source_->values(), nullptr}, p, f,
                                         {&moments, nullptr}, {&stiffnesses, nullptr},
                                         {&result, nullptr});
  return hessian_blocks(std::move(result));
}

}  // namespace limber::rods
