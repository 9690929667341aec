#pragma once

#include "limber/v1/service.pb.h"
#include "server/wire/explanation.h"

namespace limber::server {

/// Explains the choices for a session of a linkage, and the quality of its newest result.
/// @param status  with its result
/// @param linkage  as the session has it: with edges per segment, also where it chose them
/// @param edges  how their number was chosen
[[nodiscard]] limber::v1::ExplainResponse explain_linkage(const limber::v1::SessionStatus& status,
                                                          const limber::v1::RodLinkage& linkage,
                                                          ChosenBy edges);

}  // namespace limber::server
