#pragma once

#include "limber/v1/service.pb.h"

namespace limber::server {

/// What was chosen for a session of a linkage, and what its newest result is worth.
/// @param status  with its result  @param linkage  as the session has it
[[nodiscard]] limber::v1::ExplainResponse explain_linkage(const limber::v1::SessionStatus& status,
                                                          const limber::v1::RodLinkage& linkage);

}  // namespace limber::server
