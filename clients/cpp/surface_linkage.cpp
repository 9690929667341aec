#include "clients/cpp/surface_linkage.h"

#include <utility>

#include "clients/cpp/linkage_design.h"

namespace limber::client {
namespace {

constexpr double kFlatAngle = 25;   // [degree]
constexpr double kFlatShare = 0.5;  // of it, that no joint of the flat grid is to close beyond
constexpr double kPull = 1;         // [m/s^2]

/// Of the weight, and of the joint that the grid was held by: in its middle it is from now on.
void let_go(LinkageSession& session, unsigned held, unsigned middle) {
  session.gravity({0, 0, 0});
  if (held == middle) return;
  session.pin(middle, v1::HELD_MOTION);
  session.release(held);
}

void demand_open(LinkageSession& session, Milliseconds timeout) {
  if (!session.wait(timeout).solve_failed()) return;
  session.close();
  throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "surface",
                    "the grid does not open to the angle that it has on the surface: try fewer "
                    "rods, another flat angle or a section that bends more easily");
}

}  // namespace

SurfaceLinkage open_on_surface(Client& client, v1::MakeStartingGridRequest grid, v1::Scene rods,
                               const std::string& session, Milliseconds timeout) {
  if (!grid.has_flat_angle_degrees()) grid.set_flat_angle_degrees(kFlatAngle);
  constexpr unsigned kDefault = 8;  // joints along each rod
  const unsigned columns = grid.has_columns() ? grid.columns() : kDefault;
  const unsigned rows = grid.has_rows() ? grid.rows() : kDefault;
  const unsigned middle = rows / 2 * columns + columns / 2;
  if (rods.linkage().has_section()) *grid.mutable_section() = rods.linkage().section();
  const v1::MakeStartingGridResponse made = client.call(grid, LinkageDesign::kLarge);
  v1::RodLinkage& linkage = *rods.mutable_linkage();
  *linkage.mutable_lines()->mutable_arrays() = made.flat();
  auto& conditions = *linkage.mutable_conditions();
  conditions.set_mean_angle_degrees(made.mean_angle_degrees());
  auto& pin = *conditions.add_pins();
  pin.set_joint(made.held_joint());
  pin.set_held(v1::HELD_MOTION);
  conditions.mutable_gravity()->set_z(made.rise() >= 0 ? -kPull : kPull);  // down for domes
  LinkageSession opened = LinkageSession::open(client, rods, session, timeout);
  demand_open(opened, timeout);
  let_go(opened, made.held_joint(), middle);
  demand_open(opened, timeout);
  v1::StartDesignRequest design;
  design.set_session(opened.id());
  *design.mutable_goal()->mutable_surface() = grid.surface();
  if (grid.has_placement()) *design.mutable_goal()->mutable_placement() = grid.placement();
  *design.mutable_fitted_points() = made.deployed().vertices();
  design.set_flat_angle_degrees(grid.flat_angle_degrees());
  design.set_smallest_angle_degrees(kFlatShare * grid.flat_angle_degrees());
  return {std::move(opened), std::move(design), made.misfit()};
}

}  // namespace limber::client
