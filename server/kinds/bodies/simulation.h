#pragma once

#include <string>

#include "engine/session/bodies/simulation.h"
#include "limber/v1/scene.pb.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"
#include "server/wire/faults.h"

namespace limber::server {

/// Absent fields get the defaults that the .proto states; what of a list cannot be read is out of
/// range in the value, so that it passes for nothing else.
/// @param field  path of the message
/// @param nodes  of the mesh, for arrays over them; 0 where the mesh could not be read: those are
/// only compared with themselves
[[nodiscard]] scene::Simulation decode_simulation(const proto::Simulation& message,
                                                  const std::string& field, int nodes,
                                                  Faults& faults);
[[nodiscard]] proto::Simulation encode_simulation(const scene::Simulation& simulation);

[[nodiscard]] proto::SimulationReport encode_report(const session::SimulatedMotion& motion);

}  // namespace limber::server
