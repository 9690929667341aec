#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/beams/model/beam_model.h"
#include "engine/beams/refinement/subdivision_choice.h"
#include "engine/beams/structure/beam_state.h"
#include "engine/scene/beams.h"
#include "engine/session/beams/conditions.h"
#include "limber/v1/beams.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// A structure as it came, with what the engine does not keep of it.
struct DecodedBeams {
  std::string name;
  beams::BeamModel model;
  std::vector<proto::BeamSection> sections;
  /// For a scene: the shape that opening begins in; none: as drawn.
  std::optional<beams::BeamState> shape;
  /// For a scene: elements per element of the structure.
  beams::BeamDiscretisation discretisation = {};
};

/// A structure as it came, valid. Fields of errors are those of the message.
/// @throws Refusal INVALID_ARGUMENT, Error as beams::validate, naming `field` and its members
[[nodiscard]] DecodedBeams decode_beam_structure(const proto::BeamStructure& message,
                                                 const std::string& field);

/// The same where nodes and elements are those of a drawing and the message has none; `lines` is
/// the field of the drawing.
[[nodiscard]] DecodedBeams decode_beam_structure(const proto::BeamStructure& message,
                                                 const scene::EdgeMesh& drawing,
                                                 const std::string& field,
                                                 const std::string& lines);

/// A job of the public relaxation code with its mesh, valid.
/// @throws Refusal or Error naming `field`; the message names the member and the file
[[nodiscard]] DecodedBeams decode_beam_job(const proto::MeshFile& message,
                                           const std::string& field);

/// For edits. @throws Refusal naming `field` and its members
[[nodiscard]] beams::BeamSupport decode_support(const proto::BeamSupport& message,
                                                const std::string& field);
[[nodiscard]] beams::PrescribedMotion decode_beam_motion(const proto::BeamMotion& message,
                                                         const std::string& field);
void encode_beam_motion(const beams::PrescribedMotion& motion, proto::BeamMotion& message);
[[nodiscard]] beams::NodalLoad decode_nodal_load(const proto::BeamLoad& message,
                                                 const std::string& field);
[[nodiscard]] beams::DistributedLoad decode_distributed(const proto::BeamDistributedLoad& message,
                                                        const std::string& field);

/// What acts on a structure. Fields of errors are those of the message, below `field`; what the
/// structure makes of it is not looked at.
[[nodiscard]] session::BeamConditions decode_beam_conditions(const proto::BeamStructure& message,
                                                             const std::string& field);
/// A structure without nodes, sections and elements.
[[nodiscard]] proto::BeamStructure encode_beam_conditions(
    const session::BeamConditions& conditions);

/// The message that decodes to the same structure.
[[nodiscard]] proto::BeamStructure encode_beam_structure(const DecodedBeams& structure);

}  // namespace limber::server
