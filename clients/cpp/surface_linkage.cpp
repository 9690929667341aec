#include "clients/cpp/surface_linkage.h"

#include <cstring>
#include <utility>

#include "clients/cpp/linkage_design.h"

namespace limber::client {
namespace {

constexpr double kBulge = 0.05;
constexpr double kFlatAngle = 25;  // [degree]: closed, so that there is far to open
constexpr double kPull = 1;        // [m/s^2]

/// A weight that says to which side a grid that is held in its middle opens: down for domes.
v1::Vector3 pull_of(const v1::LineArrays& flat, unsigned columns, unsigned rows, unsigned middle) {
  const std::string& data = flat.vertices().data();  // float64, x y z
  const auto height = [&](unsigned vertex) {
    double z = 0;
    std::memcpy(&z, data.data() + (3 * std::size_t{vertex} + 2) * sizeof(double), sizeof z);
    return z;
  };
  const unsigned last = columns * rows - 1;
  const double rim =
      (height(0) + height(columns - 1) + height(last - columns + 1) + height(last)) / 4;
  v1::Vector3 pull;
  pull.set_z(height(middle) >= rim ? -kPull : kPull);
  return pull;
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
  if (!grid.has_bulge()) grid.set_bulge(kBulge);
  if (!grid.has_flat_angle_degrees()) grid.set_flat_angle_degrees(kFlatAngle);
  constexpr unsigned kDefault = 8;  // joints along each rod
  const unsigned columns = grid.has_columns() ? grid.columns() : kDefault;
  const unsigned rows = grid.has_rows() ? grid.rows() : kDefault;
  const unsigned middle = rows / 2 * columns + columns / 2;
  if (rods.linkage().has_section()) *grid.mutable_section() = rods.linkage().section();
  const v1::MakeStartingGridResponse made = client.call(grid, LinkageDesign::kLarge);
  v1::RodLinkage& linkage = *rods.mutable_linkage();
  *linkage.mutable_lines()->mutable_arrays() = made.flat();
  *linkage.mutable_conditions()->mutable_segment_lengths() = made.segment_lengths();
  auto& conditions = *linkage.mutable_conditions();
  conditions.set_mean_angle_degrees(made.mean_angle_degrees());
  auto& pin = *conditions.add_pins();
  pin.set_joint(middle);
  pin.set_held(v1::HELD_MOTION);
  *conditions.mutable_gravity() = pull_of(made.flat(), columns, rows, middle);
  LinkageSession opened = LinkageSession::open(client, rods, session, timeout);
  demand_open(opened, timeout);
  opened.gravity({0, 0, 0});
  demand_open(opened, timeout);
  v1::StartDesignRequest design;
  design.set_session(opened.id());
  *design.mutable_goal()->mutable_surface() = grid.surface();
  if (grid.has_placement()) *design.mutable_goal()->mutable_placement() = grid.placement();
  *design.mutable_fitted_points() = made.deployed().vertices();
  return {std::move(opened), std::move(design), made.misfit()};
}

}  // namespace limber::client
