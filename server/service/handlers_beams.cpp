// Structures of beams: solved as jobs, or kept in sessions.
#include <fmt/format.h>

#include <boost/asio/post.hpp>

#include "engine/session/beams/remarks.h"
#include "server/kinds/beams/edit.h"
#include "server/kinds/beams/export.h"
#include "server/kinds/beams/record.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/beams/solution.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/scene.h"
#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/service.h"
#include "server/wire/edit_fields.h"

namespace limber::server {

proto::SolveBeamsResponse Service::solve_beams(const proto::SolveBeamsRequest& request) {
  BeamRequest decoded = decode_beams(request);
  const std::uint64_t bytes = estimate_beam_bytes(decoded.model, decoded.shapes);
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  if (limit > 0 && bytes > limit)
    throw limit_exceeded(request.has_job() ? "job" : "structure", "estimated bytes of the solution",
                         limit, bytes);
  proto::SolveBeamsResponse response;
  response.set_job(
      start_job("beams", "", [decoded = std::move(decoded)](const JobContext& context) {
        const session::BeamAnalysis analysis =
            session::analyse(decoded.model, decoded.options, decoded.shapes, context);
        JobProduct product;
        product.beams = encode_beams(analysis);
        product.files = beam_files(analysis, decoded);
        for (const auto& issue : session::beam_remarks(decoded.model)) {
          product.issues.push_back(encode_issue(issue, "structure."));
          *product.beams->add_issues() = product.issues.back();
        }
        return product;
      }));
  return response;
}

EdgeLoader Service::edge_loader() const {
  return server::edge_loader([this](const std::string& path, const std::string& field) {
    return meshes_.resolve(path, field);
  });
}

proto::OpenSessionResponse Service::open_beams(const proto::OpenSessionRequest& request) {
  const auto name = sessions_.reserve(request.session());
  DecodedBeams structure = decode_beam_scene(request.scene(), "scene.", edge_loader());
  demand_beam_memory(structure.model, hub_.options.limits.session_bytes);
  const std::string& id = name->key().name;
  const JobId job = start_open_job(name->key());
  JobGuard guard(hub_.jobs, job);
  beams::BeamModel model = structure.model;
  std::optional<beams::BeamState> shape = structure.shape;
  const auto record = std::make_shared<BeamRecord>(hub_, name->key(), std::move(structure), job);
  put(record);
  try {
    record->attach(std::make_shared<session::BeamSession>(
        id, std::move(model), session::BeamLimits{},
        [this](std::function<void()> task) {
          boost::asio::post(hub_.session_pool, std::move(task));
        },
        record, std::move(shape)));
  } catch (const std::exception& fault) {
    sessions_.remove(*record);
    guard.fail(fault);
    throw;
  }
  guard.release();
  log::info("session {} opened: {} nodes, {} elements of beams", id,
            record->opened().model.nodes.size(), record->opened().model.elements.size());
  proto::OpenSessionResponse response;
  response.set_session(id);
  response.set_uid(name->key().uid);
  response.set_job(job);
  for (const auto& issue : session::beam_remarks(record->opened().model))
    *response.add_issues() = encode_issue(issue, "scene.beams.structure.");
  return response;
}

proto::EditResponse Service::edit_beams(BeamRecord& record, const proto::EditRequest& request) {
  const auto session = record.session();
  const auto edits = decode_beam_edits(request, record.opened().model.nodes);
  std::optional<session::Revision> expected;
  if (request.has_expected_revision()) expected = request.expected_revision();
  try {
    const session::EditReceipt receipt = session->edit(edits, expected);
    proto::EditResponse response = encode_beam_receipt(receipt);
    for (scene::Issue issue : receipt.issues) {
      issue.field = edit_field_in(request, issue.field);
      *response.add_issues() = encode_issue(issue, "");
    }
    return response;
  } catch (const Error& error) {
    const std::string field = edit_field_in(request, error.field());
    if (is_too_many_steps(error)) throw too_many_steps(field, error);
    throw Error(error.code(), field, error.what());
  }
}

proto::GetSessionResponse Service::get_beam_session(const BeamRecord& record,
                                                    const proto::GetSessionRequest& request) const {
  proto::GetSessionResponse response;
  *response.mutable_status() = record.status();
  if (!request.with_scene() && !request.with_base_motion()) return response;
  *response.mutable_scene() = encode_beam_scene(
      {record.opened().name, record.session()->model(), record.opened().sections, std::nullopt});
  return response;
}

proto::GetBeamSolutionResponse Service::get_beam_solution(
    const proto::GetBeamSolutionRequest& request) const {
  const auto found = sessions_.find(request.session());
  if (const auto record = std::dynamic_pointer_cast<BeamRecord>(found))
    return beam_solution(*record);
  throw Error(ErrorCode::kFailedPrecondition, "session",
              fmt::format("session '{}' is of {}: there is no solution of beams", found->id(),
                          found->subject()));
}

}  // namespace limber::server
