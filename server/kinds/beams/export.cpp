#include "server/kinds/beams/export.h"

#include "engine/session/beams/files.h"
#include "server/kinds/beams/result.h"
#include "server/kinds/beams/scene.h"
#include "server/kinds/beams/solution.h"
#include "server/runtime/export_parts.h"
#include "server/wire/file_stem.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

std::vector<TextFile> files_of(const session::BeamAnalysis& analysis, proto::ExportFormat format,
                               const std::string& stem) {
  switch (format) {
    case proto::EXPORT_FORMAT_VTU:
      return {{stem + ".vtu", session::beam_vtu(analysis)}};
    case proto::EXPORT_FORMAT_CSV:
      return {
          {stem + "_nodes.csv", session::beam_nodes_csv(analysis)},
          {stem + "_elements.csv", session::beam_elements_csv(analysis)},
          {stem + "_stations.csv", session::beam_stations_csv(analysis, beams::kDefaultStations)}};
    default:
      return {{stem + "_shape.json", session::beam_json(analysis, beams::kDefaultStations)}};
  }
}

std::shared_ptr<const session::BeamResult> in_balance(
    std::shared_ptr<const session::BeamResult> result) {
  if (!result->analysis) {
    throw Error(ErrorCode::kFailedPrecondition, "session",
                "no equilibrium was found yet: " + result->report.message);
  }
  return result;
}

/// As edited, in the newest equilibrium if there is one.
proto::Scene scene_in_shape(const BeamRecord& record) {
  const auto session = record.session();
  DecodedBeams scene{record.opened().name, session->model(), record.opened().sections, std::nullopt,
                     record.opened().discretisation};
  if (const auto result = session->final_result(); result && result->analysis)
    scene.shape = result->analysis->solution.state;
  return encode_beam_scene(scene);
}

std::shared_ptr<const session::BeamResult> beam_result_of(BeamRecord& record,
                                                          const proto::ExportRequest& request) {
  if (request.part() == 0) record.exports().begin(in_balance(record.demand_result(true)));
  return record.exports().find(request.part() == 0 ? 0 : request.result_sequence());
}

}  // namespace

proto::ExportResponse export_beams(BeamRecord& record, const proto::ExportRequest& request) {
  const std::string stem = decode_file_stem(request.stem(), "beams");
  switch (request.format()) {
    case proto::EXPORT_FORMAT_SCENE:
      return cut_into_parts({{stem + ".json", scene_to_json(scene_in_shape(record))}},
                            request.part());
    case proto::EXPORT_FORMAT_VTU:
    case proto::EXPORT_FORMAT_CSV:
    case proto::EXPORT_FORMAT_JSON:
      break;
    case proto::EXPORT_FORMAT_UNSPECIFIED:
      throw invalid("format", "unspecified");
    default:
      throw invalid("format", "a structure of beams is exported as VTU, CSV, JSON or SCENE");
  }
  const auto result = beam_result_of(record, request);
  proto::ExportResponse response =
      cut_into_parts(files_of(*result->analysis, request.format(), stem), request.part());
  *response.mutable_result() = encode_beam_result(*result);
  return response;
}

proto::GetBeamSolutionResponse beam_solution(const BeamRecord& record,
                                             const proto::GetBeamSolutionRequest& request) {
  const int stations = decode_stations(request);
  const auto result = in_balance(record.demand_result(true));
  proto::GetBeamSolutionResponse response;
  *response.mutable_result() = encode_beam_result(*result);
  *response.mutable_solution() = encode_beams(*result->analysis, stations);
  return response;
}

}  // namespace limber::server
