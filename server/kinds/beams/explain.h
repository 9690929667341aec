#pragma once

#include "limber/v1/service.pb.h"

namespace limber::server {

/// What was chosen for a session of a structure of beams, and what its newest result is worth.
/// @param status  with its result  @param scene  as the session has it
[[nodiscard]] limber::v1::ExplainResponse explain_beams(const limber::v1::SessionStatus& status,
                                                        const limber::v1::BeamScene& scene);

}  // namespace limber::server
