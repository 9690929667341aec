// Sessions of rod linkages: opening and editing.
#include <fmt/format.h>

#include <boost/asio/post.hpp>

#include "engine/session/linkages/remarks.h"
#include "server/kinds/bodies/scene.h"
#include "server/kinds/linkages/edit.h"
#include "server/kinds/linkages/record.h"
#include "server/kinds/linkages/scenes.h"
#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/service.h"
#include "server/wire/edit_fields.h"

namespace limber::server {
namespace {

LinkageRecord::Opened describe_linkage(const std::string& id, const proto::Scene& message,
                                       const scene::Linkage& linkage,
                                       const session::LinkageCheck& sizes) {
  const auto& lines = message.linkage().lines();
  return {id,
          linkage.name,
          lines.has_path() || lines.has_sample() ? lines : proto::LineSource(),
          sizes.joints,
          sizes.segments,
          linkage.length_unit_in_metres};
}

}  // namespace

LineLoader Service::line_loader() const {
  return server::line_loader([this](const std::string& path, const std::string& field) {
    return meshes_.resolve(path, field);
  });
}

proto::OpenSessionResponse Service::open_linkage(const proto::OpenSessionRequest& request) {
  const proto::Scene& message = request.scene();
  const auto name = sessions_.reserve(request.session());
  scene::Linkage linkage = decode_linkage(message, "scene.", line_loader());
  const session::LinkageCheck sizes = check_linkage(linkage, hub_.options.limits.session_bytes);
  with_linkage_fields(message, "scene.", [&] { session::demand_sound(sizes); });
  const auto remarks = session::linkage_remarks(linkage);
  const std::string& id = name->key().name;
  const JobId job = start_open_job(name->key());
  JobGuard guard(hub_.jobs, job);
  const auto record = std::make_shared<LinkageRecord>(
      hub_, name->key(), describe_linkage(id, message, linkage, sizes), job);
  session::LinkageLimits limits;
  limits.max_targets = static_cast<int>(hub_.options.limits.constraints);
  put(record);
  try {
    record->attach(with_linkage_fields(message, "scene.", [&] {
      return std::make_shared<session::LinkageSession>(
          id, std::move(linkage), limits,
          [this](std::function<void()> task) {
            boost::asio::post(hub_.session_pool, std::move(task));
          },
          record);
    }));
  } catch (const std::exception& fault) {
    sessions_.remove(*record);
    hub_.jobs.failed(job, error_to_proto(fault));
    guard.release();
    throw;
  }
  guard.release();
  log::info("session {} opened: {} segments, {} joints", id, sizes.segments, sizes.joints);
  proto::OpenSessionResponse response;
  response.set_session(id);
  response.set_uid(name->key().uid);
  response.set_job(job);
  for (scene::Issue issue : remarks) {
    issue.field = linkage_field_in(message, issue.field);
    *response.add_issues() = encode_issue(issue, "scene.");
  }
  return response;
}

proto::EditResponse Service::edit_linkage(LinkageRecord& record,
                                          const proto::EditRequest& request) {
  const auto session = record.session();
  const auto edits = decode_linkage_edits(request);
  std::optional<session::Revision> expected;
  if (request.has_expected_revision()) expected = request.expected_revision();
  try {
    const session::EditReceipt receipt = session->edit(edits, expected);
    proto::EditResponse response = encode_linkage_receipt(receipt);
    for (scene::Issue issue : receipt.issues) {
      issue.field = edit_field_in(request, issue.field);
      *response.add_issues() = encode_issue(issue, "");
    }
    return response;
  } catch (const Error& error) {
    const std::string field = edit_field_in(request, error.field());
    if (is_too_many_steps(error)) throw too_many_steps(field, error);
    if (error.code() == ErrorCode::kLimitExceeded) {
      const std::uint64_t limit = hub_.options.limits.constraints;
      throw limit_exceeded(field, "targets", limit, limit + 1);
    }
    throw Error(error.code(), field, error.what());
  }
}

proto::GetSessionResponse Service::get_linkage_session(
    const LinkageRecord& record, const proto::GetSessionRequest& request) const {
  proto::GetSessionResponse response;
  *response.mutable_status() = record.status();
  if (!request.with_scene() && !request.with_base_motion()) return response;
  *response.mutable_scene() = encode_linkage(record.session()->linkage());
  if (record.opened().lines.source_case() != proto::LineSource::SOURCE_NOT_SET)
    *response.mutable_scene()->mutable_linkage()->mutable_lines() = record.opened().lines;
  return response;
}

}  // namespace limber::server
