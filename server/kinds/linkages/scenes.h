#pragma once

#include <string>
#include <vector>

#include "engine/session/linkages/mapping.h"
#include "limber/v1/scene.pb.h"
#include "server/kinds/linkages/scene.h"
#include "server/runtime/session_memory.h"
#include "server/wire/line_source.h"

namespace limber::server {

/// One of limber's own linkages as a message; its lines are named, not sent.
[[nodiscard]] proto::Scene linkage_sample_scene(const std::string& name);

/// @param resolve  the file of this machine that a path means, or throws naming the field
[[nodiscard]] LineLoader line_loader(PathResolver resolve);

/// All that opening a linkage is refused for: `session::check_linkage`, after a look at its size.
/// @param session_bytes  a session may take, estimated; 0: no limit
/// @throws Refusal LIMIT_EXCEEDED naming "scene"
[[nodiscard]] session::LinkageCheck check_linkage(const scene::Linkage& linkage,
                                                  std::uint64_t session_bytes);

/// Edges per segment that may be chosen for a tolerance, so that a session stays within its bytes.
/// Memory of a session of it [bytes], with the edges that it is opened with.
[[nodiscard]] SessionMemory estimate_linkage_memory(const scene::Linkage& linkage);
[[nodiscard]] int most_chosen_edges(const scene::Linkage& linkage, std::uint64_t session_bytes);

/// All that is wrong with a scene of a linkage; the first is what opening it is refused with.
[[nodiscard]] std::vector<proto::Issue> linkage_issues(const proto::Scene& message,
                                                       const std::string& prefix,
                                                       const LineLoader& load_lines,
                                                       std::uint64_t session_bytes);

}  // namespace limber::server
