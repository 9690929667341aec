#pragma once

#include "limber/v1/service.pb.h"
#include "server/kinds/linkages/record.h"

namespace limber::server {

/// A part of the files of a linkage's newest final shape. Formats: EXPORT_FORMAT_VTP (a file for
/// each equilibrium along the path), _OBJ, _JSON, or _SCENE (with the lines as .obj next to it,
/// which `limber open` reads again). Parts have about 16 MB.
/// @throws Refusal naming `format` for those of bodies, OUT_OF_RANGE naming `part`,
/// FAILED_PRECONDITION where there is no final result yet
[[nodiscard]] proto::ExportResponse export_linkage(LinkageRecord& record,
                                                   const proto::ExportRequest& request);

}  // namespace limber::server
