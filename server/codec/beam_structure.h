#pragma once

#include "engine/beams/model/beam_model.h"
#include "limber/v1/beams.pb.h"
#include "server/codec/errors.h"

namespace limber::server {

/// A structure as it came, valid. Fields of errors are those of the message.
/// @throws Refusal INVALID_ARGUMENT, Error as beams::validate, naming `field` and what is below it
[[nodiscard]] beams::BeamModel decode_beam_structure(const proto::BeamStructure& message,
                                                     const std::string& field);

/// A job of the public relaxation code with its mesh, valid.
/// @throws Refusal or Error naming `field`; the message says which member of which file
[[nodiscard]] beams::BeamModel decode_beam_job(const proto::MeshFile& message,
                                               const std::string& field);

}  // namespace limber::server
