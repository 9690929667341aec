#pragma once

#include <functional>
#include <string>

#include "limber/v1/scene.pb.h"
#include "server/kinds/beams/structure.h"

namespace limber::server {

/// Resolves files of lines. `field` is the path of the source for errors.
using EdgeLoader =
    std::function<scene::EdgeMesh(const proto::LineSource& source, const std::string& field)>;

/// The structure of a scene that has one, valid.
/// @param prefix  path of the message, "scene." or empty
/// @throws Refusal or Error with a path below `prefix`; also for fields that other scenes have
[[nodiscard]] DecodedBeams decode_beam_scene(const proto::Scene& message, const std::string& prefix,
                                             const EdgeLoader& load_edges);

/// Whole: nodes and elements are in the message, wherever they came from, and the shape if any.
[[nodiscard]] proto::Scene encode_beam_scene(const DecodedBeams& structure);

}  // namespace limber::server
