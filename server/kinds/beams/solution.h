#pragma once

#include <vector>

#include "engine/session/beams/analysis.h"
#include "limber/v1/beams.pb.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// What a client asks to be solved, valid.
struct BeamRequest {
  beams::BeamModel model;
  beams::BeamSolveOptions options;
  int shapes = 0;
  std::vector<proto::BeamFileFormat> files;
  std::string stem;
};

/// @throws Refusal or Error with a path below the request
[[nodiscard]] BeamRequest decode_beams(const proto::SolveBeamsRequest& request);

/// UNSPECIFIED of a cancelled solve, and of a method that is still to be chosen.
[[nodiscard]] proto::BeamStatus encode_beam_status(beams::BeamStatus status);
[[nodiscard]] proto::BeamMethod encode_beam_method(beams::BeamMethod method);
void encode_beam_snaps(const std::vector<beams::BeamSnap>& snaps,
                       google::protobuf::RepeatedPtrField<proto::BeamSnap>& messages);
[[nodiscard]] proto::BeamEnergies encode_beam_energies(const beams::BeamEnergies& energies);
/// Their nodes: elements x 2, int32.
[[nodiscard]] proto::Array encode_beam_elements(const beams::BeamModel& model);

[[nodiscard]] proto::BeamSolution encode_beams(const session::BeamAnalysis& analysis);

/// The files that a request asks for, in its order.
[[nodiscard]] std::vector<proto::ExportedFile> beam_files(const session::BeamAnalysis& analysis,
                                                          const BeamRequest& request);

}  // namespace limber::server
