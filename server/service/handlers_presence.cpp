// The clients in a session and the authors of its revisions.
#include <mutex>

#include "server/log/log.h"
#include "server/service/service.h"
#include "server/wire/edits.h"
#include "server/wire/errors.h"

namespace limber::server {

Attendance::Joined Service::enter(Record& record, const Ticket& ticket,
                                  const ClientIdentity& client) {
  const auto joined = record.attendance().join(client, Attendance::Clock::now());
  // Its connection may have ended meanwhile: disconnected() was called, or will find it here.
  if (!clients_.is_connected(ticket.client(), client.number)) {
    record.attendance().leave(client.number);
    return Attendance::Joined::kAgain;
  }
  return joined;
}

void Service::note_revision(Record& record, const Ticket& ticket, const std::string& name,
                            std::uint64_t revision, std::vector<std::string> edits) {
  const ClientIdentity client = ClientDirectory::identify(ticket, name);
  const auto joined = enter(record, ticket, client);
  record.attendance().note_revision(client, revision, std::move(edits), Attendance::Clock::now());
  if (joined == Attendance::Joined::kNew) record.publish_status();
}

void Service::edit_session(const SharedTicket& ticket, const Request& request) {
  (void)ClientDirectory::identify(*ticket, request.client_name());
  kept_.demand_writable();
  const auto record = kept_.find(request.edit().session());
  std::unique_lock order(record->edit_order(), std::defer_lock);
  if (kept_.is_on()) order.lock();
  record->touch();
  proto::Reply reply;
  const std::string author = ClientDirectory::author_of(*ticket, request.client_name());
  try {
    *reply.mutable_edit() = edit(*record, request.edit(), author);
  } catch (const Error& fault) {
    if (fault.code() != ErrorCode::kFailedPrecondition || ticket->key().empty()) throw;
    throw Error(fault.code(), fault.field(), with_names_of_keys(fault.what()));
  }
  const std::uint64_t revision = reply.edit().revision();
  note_revision(*record, *ticket, request.client_name(), revision, kinds_of_edits(request.edit()));
  keep_edit(ticket, request, *record, revision, std::move(reply));
}

void Service::join_session(const SharedTicket& ticket, const Request& request) {
  const ClientIdentity client = ClientDirectory::identify(*ticket, request.client_name());
  const auto record = kept_.find(request.join_session().session());
  switch (enter(*record, *ticket, client)) {
    case Attendance::Joined::kNew:
      record->publish_status();
      break;
    case Attendance::Joined::kAgain:
      break;
    case Attendance::Joined::kFull:
      throw limit_exceeded("session", "clients in a session", Attendance::kMaxClients,
                           Attendance::kMaxClients + 1);
  }
  proto::Reply reply;
  reply.mutable_join_session()->set_client(client.number);
  record->attendance().describe(*reply.mutable_join_session(), Attendance::Clock::now());
  ticket->answer(std::move(reply));
}

void Service::leave_session(const SharedTicket& ticket, const Request& request) {
  const auto record = kept_.find(request.leave_session().session());
  if (record->attendance().leave(ticket->client_number())) record->publish_status();
  proto::Reply reply;
  reply.mutable_leave_session();
  ticket->answer(std::move(reply));
}

void Service::leave_all(const std::string& client) {
  const auto number = clients_.remove(client);
  if (!number) return;
  for (const auto& record : sessions_.all()) {
    if (!record->attendance().leave(*number)) continue;
    log::debug(log::Fields{{"session", record->id()}, {"client", std::to_string(*number)}},
               "client {} has left session {}", *number, record->id());
    record->publish_status();
  }
  for (const auto& parked : sessions_.all_parked())
    if (parked.people && parked.people->leave(*number)) publish_parked(hub_, parked);
}

}  // namespace limber::server
