#pragma once

#include <string>
#include <vector>

#include "limber/v1/scene.pb.h"
#include "server/kinds/bodies/scene.h"

namespace limber::server {

/// One of limber's own scenes as a message; its mesh is named, not sent.
[[nodiscard]] proto::Scene sample_scene(const std::string& name);

/// The issues of scene::validate(), and those that only a session would refuse. Fields are the
/// engine's.
[[nodiscard]] std::vector<scene::Issue> all_issues(const scene::Scene& scene);
/// @throws Refusal LIMIT_EXCEEDED for a scene whose session would exceed the memory limit
void demand_memory(const scene::Scene& scene, const SceneLimits& limits);

/// All that can be reported of a scene before it is opened: what cannot be read, and all that
/// validation finds in the rest. The first error is the one that opening is refused with.
/// @param prefix  of fields, "scene." or empty
[[nodiscard]] std::vector<proto::Issue> scene_issues(const proto::Scene& scene,
                                                     const std::string& prefix,
                                                     const SceneLimits& limits,
                                                     const SceneReaders& readers);
/// Warnings of a scene that can be opened, fields below `prefix`.
/// @throws Error the first thing that is wrong with it
[[nodiscard]] std::vector<proto::Issue> remarks(const proto::Scene& message,
                                                const DecodedScene& decoded,
                                                const std::string& prefix);

}  // namespace limber::server
