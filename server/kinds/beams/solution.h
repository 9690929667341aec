#pragma once

#include <fmt/format.h>

#include <vector>

#include "engine/beams/results/stations.h"
#include "engine/session/beams/analysis.h"
#include "limber/v1/beams.pb.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"
#include "server/wire/indices.h"

namespace limber::server {

/// A client's request to solve, valid.
struct BeamRequest {
  beams::BeamModel model;
  beams::BeamSolveOptions options;
  int shapes = 0;
  int stations = 0;  // along each element
  std::vector<proto::BeamFileFormat> files;
  std::string stem;
  bool is_estimated = false;  // the error of the elements
};

/// @throws Refusal or Error with a path below the request
[[nodiscard]] BeamRequest decode_beams(const proto::SolveBeamsRequest& request);

/// UNSPECIFIED of a cancelled solve, and of a method that is still to be chosen.
[[nodiscard]] proto::BeamStatus encode_beam_status(beams::BeamStatus status);
[[nodiscard]] proto::BeamMethod encode_beam_method(beams::BeamMethod method);
/// The text of a report, with the snaps along the path to its answer.
[[nodiscard]] std::string beam_message(const beams::BeamReport& report);
void encode_beam_snaps(const std::vector<beams::BeamSnap>& snaps,
                       google::protobuf::RepeatedPtrField<proto::BeamSnap>& messages);
[[nodiscard]] proto::BeamNeutralDirection encode_beam_neutral_direction(
    const beams::BeamNeutralDirection& direction);
/// For a BeamSolution or a BeamInfo: neutral directions, and elements of unjudged stability.
template <class Message>
void encode_beam_stability(const beams::BeamReport& report, Message& message) {
  for (const beams::BeamNeutralDirection& direction : report.neutral_directions)
    *message.add_neutral_directions() = encode_beam_neutral_direction(direction);
  for (const int element : report.unjudged_elements)
    message.add_unjudged_elements(static_cast<std::uint32_t>(element));
}
[[nodiscard]] proto::BeamEnergies encode_beam_energies(const beams::BeamEnergies& energies);
/// Their nodes: elements x 2, int32.
[[nodiscard]] proto::Array encode_beam_elements(const beams::BeamModel& model);

/// Number of stations along each element that a request asks for. @throws Refusal naming `stations`
template <class Message>
[[nodiscard]] int decode_stations(const Message& message) {
  if (!message.has_stations()) return beams::kDefaultStations;
  const std::uint32_t count = message.stations();
  if (count == 1 || count > beams::kMaxStations)
    throw invalid("stations", fmt::format("{} stations along an element, must be 0 or in [2, {}]",
                                          count, beams::kMaxStations));
  return decode_index(count, "stations");
}

/// @param stations  along each element, >= 2; 0: none
[[nodiscard]] proto::BeamSolution encode_beams(const session::BeamAnalysis& analysis, int stations);

/// The files that a request asks for, in its order.
[[nodiscard]] std::vector<proto::ExportedFile> beam_files(const session::BeamAnalysis& analysis,
                                                          const BeamRequest& request);

}  // namespace limber::server
