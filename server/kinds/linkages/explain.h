#pragma once

#include "limber/v1/service.pb.h"
#include "server/wire/explanation.h"

namespace limber::server {

/// What was chosen for a session of a linkage, and what its newest result is worth.
/// @param status  with its result
/// @param linkage  as the session has it: with edges per segment, also where it chose them
/// @param edges  who chose those
[[nodiscard]] limber::v1::ExplainResponse explain_linkage(const limber::v1::SessionStatus& status,
                                                          const limber::v1::RodLinkage& linkage,
                                                          ChosenBy edges);

}  // namespace limber::server
