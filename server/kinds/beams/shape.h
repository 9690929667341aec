#pragma once

#include <string>

#include "engine/beams/structure/beam_state.h"
#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// A shape of a structure of beams, in full precision.
[[nodiscard]] proto::BeamShape encode_beam_shape(const beams::BeamState& state);

/// The shape of a valid model. @throws Refusal naming `field` and its members if the message has
/// other numbers of nodes or hinged ends, is too large for squares, or has an element of no length
[[nodiscard]] beams::BeamState decode_beam_shape(const proto::BeamShape& message,
                                                 const beams::BeamModel& model,
                                                 const std::string& field);

}  // namespace limber::server
