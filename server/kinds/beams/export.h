#pragma once

#include "limber/v1/service.pb.h"
#include "server/kinds/beams/record.h"

namespace limber::server {

/// A part of the files of a structure's newest equilibrium: EXPORT_FORMAT_VTU, _CSV (two tables),
/// _JSON, or _SCENE (as edited, which `limber open` reads again). Parts have about 16 MB.
/// @throws Refusal naming `format` for those of other sessions, OUT_OF_RANGE naming `part`,
/// FAILED_PRECONDITION where there is no equilibrium yet
[[nodiscard]] proto::ExportResponse export_beams(BeamRecord& record,
                                                 const proto::ExportRequest& request);

/// @throws Error{kFailedPrecondition, "session"} where there is no equilibrium yet
[[nodiscard]] proto::GetBeamSolutionResponse beam_solution(
    const BeamRecord& record, const proto::GetBeamSolutionRequest& request);

}  // namespace limber::server
