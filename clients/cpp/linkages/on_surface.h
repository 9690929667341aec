#pragma once

#include <string>

#include "clients/cpp/linkages/session.h"

namespace limber::client {

/// A linkage for a patch of surface, if only the surface is given. It is a grid of straight rods
/// that lies flat, opened, and deployed to the angle that rods cross at on the surface.
struct SurfaceLinkage {
  LinkageSession session;
  /// Begins its design: the surface, put where the grid fits the joints, the flat grid held at
  /// its angle, and none of its joints below half of that. Add what else is wanted.
  v1::StartDesignRequest design;
  double misfit = 0;  // largest difference of a length from that on the surface, as a share
  /// Obstacles for the design, and warnings of the scene; empty: none.
  std::string remark;
};

/// @param grid  the surface and the size of the grid; flat angle 25 degrees where it has none
/// @param rods  a scene with what the linkage is to be besides its lines: section, material, unit
/// @param session  its name; empty: chosen by the server
/// @throws ClientError as MakeStartingGrid, which gets the section, and LinkageSession::open;
/// FAILED_PRECONDITION with field surface where the grid does not open as far: it is closed then
[[nodiscard]] SurfaceLinkage open_on_surface(Client& client, v1::MakeStartingGridRequest grid,
                                             v1::Scene rods, const std::string& session = "",
                                             Milliseconds timeout = LinkageSession::kPatience);

}  // namespace limber::client
