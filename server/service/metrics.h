#pragma once

#include <string>

#include "limber/v1/service.pb.h"

namespace limber::server {

/// What a server says of itself in the text format of Prometheus (0.0.4). Names of sessions and
/// clients are not in it: whoever can reach the gateway may read it.
/// @param info  with `status`
[[nodiscard]] std::string metrics_text(const limber::v1::GetServerInfoResponse& info);

}  // namespace limber::server
