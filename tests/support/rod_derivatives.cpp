#include "tests/support/rod_derivatives.h"

#include "engine/base/error.h"
#include "engine/rods/rod/rod_passes.h"

namespace limber::rods {

using namespace passes;

namespace {

using D = Dual<Lane>;

/// A slot array and its derivative.
struct DualSlots {
  DualSlots(const RodLayout& layout, int fields)
      : value(slots(layout, fields)), derivative(slots(layout, fields)) {}
  [[nodiscard]] SlotsIn in() const { return {&value, &derivative}; }
  [[nodiscard]] SlotsOut out() { return {&value, &derivative}; }
  SlotArray value;
  SlotArray derivative;
};

/// State and parameters moving along a direction.
struct Moving {
  Moving(const RodState& state, const RodParameters& from, const RodDirection& direction)
      : layout(state.layout()),
        form(from.form),
        source{&state.source().values(), nullptr},
        parameters{&from.values(),
                   direction.parameters ? &direction.parameters->values() : nullptr},
        unknown_direction(slots(layout, 4)),
        frames(layout, kFrameFields),
        twists(layout, 1),
        moments(layout, 3) {
    if (direction.unknowns.size() > 0) {
      LIMBER_DEMAND(direction.unknowns.size() == layout.unknowns());
      unknown_direction.topRows(layout.nodes()) =
          Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>>(
              direction.unknowns.data(), layout.nodes(), 4);
    }
    const SlotsIn unknowns{&state.unknown_slots(), &unknown_direction};
    passes::frames<D>(layout, source, unknowns, frames.out());
    passes::twists<D>(layout, source, unknowns, frames.in(), twists.out());
  }

  void sweep_vertices(DualSlots* stiffnesses) {
    passes::vertices<D>(layout, parameters, form, frames.in(), twists.in(),
                        {moments.out(), stiffnesses ? stiffnesses->out() : SlotsOut{}, nullptr});
  }

  const RodLayout& layout;
  BendingForm form;
  SlotsIn source;
  SlotsIn parameters;
  SlotArray unknown_direction;
  DualSlots frames;
  DualSlots twists;
  DualSlots moments;
};

}  // namespace

Eigen::VectorXd gradient_derivative(const RodState& state, const RodParameters& parameters,
                                    const RodDirection& direction) {
  const RodLayout& layout = state.layout();
  Moving moving(state, parameters, direction);
  moving.sweep_vertices(nullptr);
  DualSlots edges(layout, 4);
  passes::edge_gradients<D>(layout, moving.parameters, moving.frames.in(), moving.moments.in(),
                            edges.out(), nullptr);
  return gather(layout, edges.derivative);
}

HessianBlocks hessian_derivative(const RodState& state, const RodParameters& parameters,
                                 const RodDirection& direction) {
  const RodLayout& layout = state.layout();
  Moving moving(state, parameters, direction);
  DualSlots stiffnesses(layout, 6), result(layout, kBlockFields);
  moving.sweep_vertices(&stiffnesses);
  passes::blocks<D, Transport::kFinite>(layout, moving.source, moving.parameters,
                                        moving.frames.in(), moving.moments.in(), stiffnesses.in(),
                                        result.out());
  return hessian_blocks(std::move(result.derivative));
}

HessianBlocks transported_hessian(const RodState& state, const RodParameters& parameters) {
  const RodLayout& layout = state.layout();
  const SlotsIn p{&parameters.values(), nullptr}, f{&state.frame_slots(), nullptr};
  SlotArray moments = slots(layout, 3), stiffnesses = slots(layout, 6);
  SlotArray result = slots(layout, kBlockFields);
  passes::vertices<Lane>(layout, p, parameters.form, f, {&state.twist_slots(), nullptr},
                         {{&moments, nullptr}, {&stiffnesses, nullptr}, nullptr});
  passes::blocks<Lane, Transport::kFinite>(layout, {&state.source().values(), nullptr}, p, f,
                                           {&moments, nullptr}, {&stiffnesses, nullptr},
                                           {&result, nullptr});
  return hessian_blocks(std::move(result));
}

}  // namespace limber::rods
