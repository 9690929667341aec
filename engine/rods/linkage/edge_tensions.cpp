#include "engine/rods/linkage/edge_tensions.h"

#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/rod/stretch_element.h"

namespace limber::rods {
namespace {

using detail::ChainLane;
// Share of a step over which rates are taken; vertices next to joints move along curves.
constexpr double kPart = 1e-4;

Vec3<ChainLane> edge_at(const double* slots, int e) {
  const double* const slot = slots + e * LinkageState::kFields * kChainLanes;
  return detail::load_lanes3(slot + LinkageState::kFields * kChainLanes) -
         detail::load_lanes3(slot);
}

}  // namespace

void EdgeTensions::expect(const LinkageModel& model, const LinkageState& from,
                          const Eigen::Ref<const Eigen::VectorXd>& step) {
  const LinkageState beside = from.moved(model, kPart * step, LinkageState::Parts::kVertices);
  for (int b = 0; b < static_cast<int>(model.chains()->batches().size()); ++b) {
    const double* const parameters = model.slot_parameters(b);
    for (int e = 0; e < model.chains()->batches()[b].edges; ++e) {
      const auto parameter = [&](int field) {
        return detail::load_lane(parameters + (e * LinkageModel::kFields + field) * kChainLanes);
      };
      const auto edge = edge_at(from.slots(model, b), e);
      const ChainLane length = norm(edge);
      const ChainLane change =
          (1.0 / kPart) * dot(edge_at(beside.slots(model, b), e) - edge, edge) / length;
      const auto then = stretch<ChainLane>(length + change, parameter(LinkageModel::kRestLength),
                                           parameter(LinkageModel::kStretching));
      detail::store_lane(cells_[model.first_slot(b) + static_cast<std::size_t>(e)].values,
                         then.tension);
    }
  }
}

}  // namespace limber::rods
