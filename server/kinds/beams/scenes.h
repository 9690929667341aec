#pragma once

#include <string>
#include <vector>

#include "server/kinds/beams/scene.h"
#include "server/runtime/session_memory.h"
#include "server/wire/line_source.h"

namespace limber::server {

/// Memory of a session of it [bytes], its elements as they are.
[[nodiscard]] SessionMemory estimate_beam_memory(const beams::BeamModel& model);

/// One of limber's own structures of beams as a message.
[[nodiscard]] proto::Scene beam_sample_scene(const std::string& name);

/// @param resolve  the file of this machine that a path means, or throws naming the field
[[nodiscard]] EdgeLoader edge_loader(PathResolver resolve);

/// @param session_bytes  a session may take, estimated; 0: no limit
/// @returns the scene's discretisation, with as many elements at most as that leaves room for
/// @throws Refusal LIMIT_EXCEEDED naming "scene"
beams::BeamDiscretisation demand_beam_memory(const DecodedBeams& scene,
                                             std::uint64_t session_bytes);

/// Problems of a scene of beams: the error that refuses it, or warnings, or nothing.
[[nodiscard]] std::vector<proto::Issue> beam_issues(const proto::Scene& message,
                                                    const std::string& prefix,
                                                    const EdgeLoader& load_edges,
                                                    std::uint64_t session_bytes);

}  // namespace limber::server
