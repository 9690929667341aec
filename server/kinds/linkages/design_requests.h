#pragma once

#include "server/kinds/linkages/design.h"
#include "server/kinds/linkages/record.h"

namespace limber::server {

/// Reads files that requests name.
[[nodiscard]] SurfaceLoader surface_loader(PathResolver resolve);

/// Designs of a session, live. As Record::answer().
[[nodiscard]] bool answer_design_request(LinkageRecord& record, const proto::Request& request,
                                         proto::Reply& reply);

}  // namespace limber::server
