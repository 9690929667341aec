// Requests about sessions of every kind.
#include <fmt/format.h>

#include <boost/asio/post.hpp>

#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/chosen_ids.h"
#include "server/service/imported_session.h"
#include "server/service/roles.h"
#include "server/service/service.h"
#include "server/store/session_rows.h"
#include "server/wire/errors.h"
#include "server/wire/wire_check.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kEditsAtOnce = 65536;

}  // namespace

void Service::open_session(const SharedTicket& ticket, const Request& request) {
  (void)ClientDirectory::identify(*ticket, request.client_name());
  const std::string author = ClientDirectory::author_of(*ticket, request.client_name());
  const std::string& client = author.empty() ? ticket->client() : author;
  proto::Reply reply;
  kept_.demand_writable();
  std::unique_lock<std::recursive_mutex> order;  // no edits and no close before it is stored
  const auto record = open(request.open_session(), client, *reply.mutable_open_session(), order);
  note_revision(*record, *ticket, request.client_name(), 0, {"open_session"});
  if (!kept_.is_on()) {
    ticket->answer(std::move(reply));
    return;
  }
  kept_.opened(ticket, record, request.open_session().scene(), std::move(reply),
               [this, record] { drop(record); });
}

/// For a session that was opened and could not be stored.
void Service::drop(const std::shared_ptr<Record>& record) {
  boost::asio::post(hub_.request_pool, [this, record] {
    sessions_.remove(*record);
    kept_.give_way(*record);
  });
}

std::shared_ptr<Record> Service::open(const proto::OpenSessionRequest& request,
                                      const std::string& client,
                                      proto::OpenSessionResponse& response,
                                      std::unique_lock<std::recursive_mutex>& order) {
  const Kind& kind = kinds_.of(request.scene(), "scene");
  demand_chosen_ids(request.scene());
  const auto name = sessions_.reserve(request.session());
  const std::unique_ptr<Opening> opening = kind.read(request.scene(), scenes_);
  const std::string& id = name->key().name;
  const auto room = kept_.parking().make_room(opening->memory());
  const JobId job = kept_.start_open_job(name->key());
  JobGuard guard(hub_.jobs, job);
  auto record = opening->make_record(hub_, name->key(), job);
  record->set_memory(opening->memory());
  if (kept_.is_on()) order = std::unique_lock(record->edit_order());
  kept_.put(record);
  try {
    opening->start(hub_, hub_.session_executor(client));
  } catch (const std::exception& fault) {
    sessions_.remove(*record);
    guard.fail(fault);
    throw;
  }
  guard.release();
  log::info(log::Fields{{"session", id}}, "session {} opened: {}", id, opening->size());
  response.set_session(id);
  response.set_uid(name->key().uid);
  response.set_kind(kind.name());
  response.set_job(job);
  for (auto& issue : opening->remarks()) *response.add_issues() = std::move(issue);
  return record;
}

proto::EditResponse Service::edit(Record& record, const proto::EditRequest& request,
                                  const session::Author& author) {
  if (static_cast<std::uint64_t>(request.edits_size()) > kEditsAtOnce) {
    throw limit_exceeded("edits", "edits in one request", kEditsAtOnce,
                         static_cast<std::uint64_t>(request.edits_size()));
  }
  demand_chosen_ids(request);
  return record.edit(request, author);
}

void Service::take_design(const SharedTicket& ticket, const Request& request) {
  kept_.demand_writable();
  ask_session(ticket, request);
}

void Service::keep_edit(const SharedTicket& ticket, const Request& request, Record& record,
                        std::uint64_t revision, proto::Reply reply) {
  const auto made = kept_.is_on() ? record.made_edits(request) : std::nullopt;
  if (made) {
    kept_.edited(ticket, record, revision, *made,
                 ClientDirectory::identify(*ticket, request.client_name()).name,
                 ClientDirectory::author_of(*ticket, request.client_name()), std::move(reply));
  } else {
    ticket->answer(std::move(reply));
  }
}

void Service::wait(const proto::WaitRequest& request, const SharedTicket& ticket) {
  const auto record = kept_.find(request.session());
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
  const auto sessions = sessions_.everything();
  for (const auto& record : sessions.records) *response.add_sessions() = record->status();
  for (const auto& parked : sessions.parked) *response.add_sessions() = parked.current_status();
  return response;
}

proto::GetSessionResponse Service::get_session(const proto::GetSessionRequest& request) {
  const auto record = kept_.find(request.session());
  proto::GetSessionResponse response;
  *response.mutable_status() = record->status();
  if (request.with_scene() || request.with_base_motion()) record->add_scene(request, response);
  return response;
}

void Service::close(const proto::CloseSessionRequest& request, const SharedTicket& ticket) {
  proto::Reply reply;
  reply.mutable_close_session();
  std::uint64_t uid = 0;
  if (const auto parked = sessions_.parked(request.session())) {
    uid = parked->key.uid;
    // Somebody was quicker: it is open, or closed.
    if (!sessions_.forget(parked->key)) return close(request, ticket);
  } else {
    const auto record = sessions_.find(request.session());
    uid = record->key().uid;
    const std::lock_guard order(record->edit_order());  // behind its opening, in the store too
    record->close();
    sessions_.remove(*record);  // the name is free only now
  }
  if (kept_.is_on()) {
    kept_.closed(ticket, uid, std::move(reply));
  } else {
    ticket->answer(std::move(reply));
  }
}

proto::SaveSessionResponse Service::save_session(const proto::SaveSessionRequest& request) {
  demand_store();
  proto::StoredSession stored = kept_.load(request.session());
  stored.set_server_version(LIMBER_VERSION);
  proto::SaveSessionResponse response;
  response.set_content(sealed(stored));
  return response;
}

void Service::restore_session(const proto::RestoreSessionRequest& request,
                              const SharedTicket& ticket) {
  demand_store();
  kept_.demand_writable();
  try {
    check_wire(request.content(), *proto::StoredSession::descriptor());
  } catch (const Refusal& refusal) {
    throw invalid("content",
                  fmt::format("this is no session that was exported: {}", refusal.what()));
  }
  proto::StoredSession stored;
  if (!stored.ParseFromString(request.content()) || stored.version() == 0)
    throw invalid("content", "this is no session that was exported");
  if (stored.version() > store::Store::kWithCheckpoint)
    throw Refusal(
        proto::ERROR_CODE_UNSUPPORTED, "content",
        fmt::format("the session is of form {}, written by limberd {}; this server reads "
                    "forms up to {}: update it",
                    stored.version(), stored.server_version(), store::Store::kWithCheckpoint));
  demand_unchanged(request.content(), stored);
  demand_countable(stored);
  store::clear_seals(stored);
  const auto name =
      sessions_.reserve(request.session().empty() ? stored.session() : request.session());
  const auto [record, order] = kept_.restore(name->key(), stored);
  log::info(log::Fields{{"session", record->id()}}, "session {} restored from a file",
            record->id());
  proto::Reply reply;
  auto& response = *reply.mutable_restore_session();
  response.set_session(record->id());
  response.set_uid(record->key().uid);
  response.set_kind(record->kind());
  response.set_revision(record->status().revision());
  kept_.imported(ticket, *record, stored, std::move(reply),
                 [this, dropped = record] { drop(dropped); });
}

void Service::demand_store() const {
  if (!kept_.is_on())
    throw Error(ErrorCode::kFailedPrecondition, "session",
                "this server keeps no sessions: start it with --data FOLDER");
}

proto::CancelResponse Service::cancel(const proto::CancelRequest& request) {
  switch (request.target_case()) {
    case proto::CancelRequest::kSession:
      kept_.find(request.session())->cancel();
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
