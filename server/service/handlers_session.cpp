// Requests about sessions of every kind.
#include <fmt/format.h>

#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kEditsAtOnce = 65536;

/// A session that had to go for another.
void close_quietly(Record& record) {
  try {
    record.close();
    log::info("session {} gave its place to another", record.id());
  } catch (const std::exception& fault) {  // a client was quicker
    log::debug("closing {}: {}", record.id(), fault.what());
  }
}

}  // namespace

JobId Service::start_open_job(const SessionKey& key) {
  return hub_.jobs.start("open_session", key.name, [this, reference = key.reference()] {
    try {
      sessions_.find(reference)->cancel();
    } catch (const std::exception& fault) {
      log::debug("cancelling {}: {}", reference, fault.what());
    }
  });
}

void Service::put(const std::shared_ptr<Record>& record) {
  for (const auto& failed : sessions_.put(record)) close_quietly(*failed);
}

void Service::open_session(const SharedTicket& ticket, const Request& request) {
  (void)ClientDirectory::identify(*ticket, request.client_name());
  proto::Reply reply;
  const auto record = open(request.open_session(), *reply.mutable_open_session());
  note_revision(*record, *ticket, request.client_name(), 0, {"open_session"});
  ticket->answer(std::move(reply));
}

std::shared_ptr<Record> Service::open(const proto::OpenSessionRequest& request,
                                      proto::OpenSessionResponse& response) {
  const Kind& kind = kinds_.of(request.scene(), "scene");
  const auto name = sessions_.reserve(request.session());
  const std::unique_ptr<Opening> opening = kind.read(request.scene(), scenes_);
  const std::string& id = name->key().name;
  const JobId job = start_open_job(name->key());
  JobGuard guard(hub_.jobs, job);
  const auto record = opening->make_record(hub_, name->key(), job);
  put(record);
  try {
    opening->start(hub_);
  } catch (const std::exception& fault) {
    sessions_.remove(*record);
    guard.fail(fault);
    throw;
  }
  guard.release();
  log::info("session {} opened: {}", id, opening->size());
  response.set_session(id);
  response.set_uid(name->key().uid);
  response.set_kind(kind.name());
  response.set_job(job);
  for (auto& issue : opening->remarks()) *response.add_issues() = std::move(issue);
  return record;
}

proto::EditResponse Service::edit(Record& record, const proto::EditRequest& request) {
  if (static_cast<std::uint64_t>(request.edits_size()) > kEditsAtOnce) {
    throw limit_exceeded("edits", "edits in one request", kEditsAtOnce,
                         static_cast<std::uint64_t>(request.edits_size()));
  }
  return record.edit(request);
}

void Service::wait(const proto::WaitRequest& request, const SharedTicket& ticket) {
  const auto record = sessions_.find(request.session());
  const double timeout = request.has_timeout_s() ? request.timeout_s() : 60.0;
  if (!(timeout > 0)) throw invalid("timeout_s", fmt::format("{} must be > 0", timeout));
  const auto until =
      request.until() == proto::WaitRequest::UNTIL_FIRST     ? ResultWaiters::Until::kFirst
      : request.until() == proto::WaitRequest::UNTIL_CHECKED ? ResultWaiters::Until::kChecked
                                                             : ResultWaiters::Until::kFinal;
  demand_room_to_wait(*ticket);
  record->waiters().wait(request.revision(), until, checked_seconds(timeout, "timeout_s"), ticket);
}

proto::ListSessionsResponse Service::list_sessions(const proto::ListSessionsRequest&) const {
  proto::ListSessionsResponse response;
  for (const auto& record : sessions_.all()) *response.add_sessions() = record->status();
  return response;
}

proto::GetSessionResponse Service::get_session(const proto::GetSessionRequest& request) const {
  const auto record = sessions_.find(request.session());
  proto::GetSessionResponse response;
  *response.mutable_status() = record->status();
  if (request.with_scene() || request.with_base_motion()) record->add_scene(request, response);
  return response;
}

proto::CloseSessionResponse Service::close(const proto::CloseSessionRequest& request) {
  const auto record = sessions_.find(request.session());
  record->close();
  sessions_.remove(*record);  // the name is free only now
  return {};
}

proto::CancelResponse Service::cancel(const proto::CancelRequest& request) {
  switch (request.target_case()) {
    case proto::CancelRequest::kSession:
      sessions_.find(request.session())->cancel();
      break;
    case proto::CancelRequest::kJob:
      hub_.jobs.cancel(request.job());
      break;
    case proto::CancelRequest::TARGET_NOT_SET:
      throw invalid("target", "a session or a job is expected");
  }
  return {};
}

}  // namespace limber::server
