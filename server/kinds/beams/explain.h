#pragma once

#include "limber/v1/service.pb.h"

namespace limber::server {

/// Explains the choices for a session of beams, and the quality of its newest result.
/// @param status  with its result  @param scene  as the session has it
[[nodiscard]] limber::v1::ExplainResponse explain_beams(const limber::v1::SessionStatus& status,
                                                        const limber::v1::BeamScene& scene);

}  // namespace limber::server
