#pragma once

#include <vector>

#include "engine/session/beams/beam_analysis.h"
#include "limber/v1/beams.pb.h"
#include "limber/v1/service.pb.h"
#include "server/codec/errors.h"

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

[[nodiscard]] proto::BeamSolution encode_beams(const session::BeamAnalysis& analysis);

/// The files that a request asks for, in its order.
[[nodiscard]] std::vector<proto::ExportedFile> beam_files(const session::BeamAnalysis& analysis,
                                                          const BeamRequest& request);

}  // namespace limber::server
