#include "clients/cpp/linkages/on_surface.h"

#include <utility>

#include "clients/cpp/linkages/design.h"

namespace limber::client {
namespace {

constexpr double kFlatAngle = 25;        // [degree]
constexpr double kFlatShare = 0.5;       // of it, that no joint of the flat grid is to close beyond
constexpr double kYoungsModulus = 10e9;  // of a scene that has none [Pa]

/// Forces that push the flat grid to its surface's side while it opens, in the scene's units.
void push(v1::Scene& scene, const v1::MakeStartingGridResponse& grid, double flat_angle) {
  v1::RodLinkage& linkage = *scene.mutable_linkage();
  const double modulus = linkage.material().has_youngs_modulus()
                             ? linkage.material().youngs_modulus()
                             : kYoungsModulus;
  const double unit = scene.has_length_unit_in_metres() ? scene.length_unit_in_metres() : 1;
  v1::LinkageErection& erection = *linkage.mutable_erection();
  erection.set_mean_angle_degrees(grid.mean_angle_degrees());
  erection.add_path_degrees(flat_angle);
  erection.add_path_degrees(grid.mean_angle_degrees());
  for (int j = 0; j < grid.push_size(); ++j) {
    if (grid.push(j) == 0) continue;
    v1::JointLoad& load = *erection.add_push();
    load.set_joint(static_cast<unsigned>(j));
    load.mutable_force()->set_z(modulus * unit * unit * grid.push(j));
  }
}

/// Unlikely properties of the grid, as its size in kilometres.
void add_warnings(Client& client, const v1::Scene& scene, std::string& remark) {
  v1::ValidateSceneRequest request;
  *request.mutable_scene() = scene;
  const v1::ValidateSceneResponse response = client.call(request);
  for (const v1::Issue& issue : response.issues()) {
    if (issue.severity() != v1::Issue::SEVERITY_WARNING) continue;
    if (!remark.empty()) remark += "; ";
    remark += issue.message();
  }
}

void demand_open(LinkageSession& session, Milliseconds timeout) {
  if (!session.wait(timeout).solve_failed()) return;
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
  v1::MakeStartingGridResponse made = client.call(grid, LinkageDesign::kLarge);
  v1::RodLinkage& linkage = *rods.mutable_linkage();
  *linkage.mutable_lines()->mutable_arrays() = made.flat();
  auto& conditions = *linkage.mutable_conditions();
  conditions.set_mean_angle_degrees(made.mean_angle_degrees());
  auto& pin = *conditions.add_pins();
  pin.set_joint(middle);
  pin.set_held(v1::HELD_MOTION);
  push(rods, made, grid.flat_angle_degrees());
  add_warnings(client, rods, *made.mutable_remark());
  LinkageSession opened = LinkageSession::open(client, rods, session, timeout);
  try {
    demand_open(opened, timeout);
  } catch (...) {
    opened.close();
    throw;
  }
  v1::StartDesignRequest design;
  design.set_session(opened.reference());
  *design.mutable_goal()->mutable_surface() = grid.surface();
  if (grid.has_placement()) *design.mutable_goal()->mutable_placement() = grid.placement();
  *design.mutable_fitted_points() = made.deployed().vertices();
  design.set_flat_angle_degrees(grid.flat_angle_degrees());
  design.set_smallest_angle_degrees(kFlatShare * grid.flat_angle_degrees());
  return {std::move(opened), std::move(design), made.misfit(), made.remark()};
}

}  // namespace limber::client
