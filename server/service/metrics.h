#pragma once

#include <string>

#include "limber/v1/service.pb.h"

namespace limber::server {

/// The metrics of a server in the text format of Prometheus (0.0.4). They contain no names of
/// sessions and clients: anyone who can reach the gateway may read them.
/// @param info  with `status`
[[nodiscard]] std::string metrics_text(const limber::v1::GetServerInfoResponse& info);

}  // namespace limber::server
