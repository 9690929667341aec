#include <fmt/format.h>

#include "server/log/log.h"
#include "server/service/roles.h"
#include "server/service/service.h"
#include "server/store/store_vfs.h"
#include "server/wire/errors.h"
#include "server/wire/version.h"

namespace limber::server {
namespace {

/// A client that can request them may do as much without them.
void add_web_tokens(Role role, const WebEntrance& web, proto::GetServerInfoResponse& info) {
  for (const auto& [of_page, token] : web.tokens) {
    if (of_page > role) continue;
    auto& message = *info.add_web_tokens();
    message.set_role(to_proto(of_page));
    message.set_token(token);
    if (of_page == role) info.set_web_token(token);
  }
}

}  // namespace

void Service::server_info(const proto::GetServerInfoRequest& request,
                          const SharedTicket& ticket) const {
  const std::string& theirs = request.client_version();
  constexpr std::size_t kMaxBytes = 64;
  if (theirs.size() > kMaxBytes)
    throw invalid("client_version",
                  fmt::format("{} bytes, at most {} are allowed", theirs.size(), kMaxBytes));
  if (!theirs.empty() && theirs != server_version()) log::debug("a client of version {}", theirs);
  proto::Reply reply;
  proto::GetServerInfoResponse& about = *reply.mutable_get_server_info();
  about = info();
  if (request.with_status()) describe_status(*about.mutable_status());
  about.set_role(to_proto(ticket->role()));
  if (ticket->way() == Ticket::Way::kSocket) add_web_tokens(ticket->role(), hub_.web, about);
  ticket->answer(std::move(reply));
}

proto::GetServerInfoResponse Service::info() const {
  proto::GetServerInfoResponse info;
  info.set_server_version(server_version());
  info.set_instance(hub_.run.instance);
  info.add_protocol_versions(kProtocolVersion);
  info.set_stream_endpoint(hub_.transport.stream_endpoint());
  info.set_follow_endpoint(hub_.transport.request_endpoint());
  const auto& given = hub_.options.limits;
  auto* limits = info.mutable_limits();
  limits->set_message_bytes(hub_.options.transport.message_bytes);
  limits->set_sessions(given.sessions);
  limits->set_mesh_tets(given.mesh_tets);
  limits->set_frames(given.frames);
  limits->set_constraints(given.constraints);
  limits->set_jobs(given.jobs);
  limits->set_session_bytes(given.session_bytes);
  limits->set_memory_bytes(hub_.memory_limit());
  info.set_uptime_s(
      std::chrono::duration<double>(std::chrono::steady_clock::now() - hub_.started).count());
  const auto& counters = hub_.counters;
  auto& out = *info.mutable_counters();
  out["requests"] = counters.requests.load();
  out["replies"] = counters.replies.load();
  out["errors"] = counters.errors.load();
  out["malformed"] = counters.malformed.load();
  out["dropped_requests"] = counters.dropped_requests.load();
  out["dropped_replies"] = counters.dropped_replies.load();
  out["repeated_requests"] = counters.repeated_requests.load();
  out["published"] = counters.published.load();
  out["replaced"] = counters.replaced.load();
  out["forced"] = counters.forced.load();
  out["followed"] = counters.followed.load();
  out["stalled"] = counters.stalled.load();
  out["withheld"] = counters.withheld.load();
  out["refused_handshakes"] = counters.refused_handshakes.load();
  out["refused_replies"] = counters.refused_replies.load();
  out["cut_off"] = counters.cut_off.load();
  out["web_connections"] = counters.web_connections.load();
  out["web_published"] = counters.web_published.load();
  out["web_refused"] = counters.web_refused.load();
  out["unread_bytes"] = hub_.transport.unread_bytes();
  out["open_requests"] = hub_.open_requests.total();
  out["session_bytes"] = kept_.parking().bytes();
  out["parked"] = counters.parked.load();
  out["brought_back"] = counters.brought_back.load();
  if (hub_.store) {
    const auto counts = hub_.store->counts();
    const auto syncs = store::Syncs::now();
    out["store_syncs"] = syncs.count;
    out["store_sync_us"] = static_cast<std::uint64_t>(syncs.seconds * 1e6);
    auto& store = *info.mutable_store();
    store.set_parked(static_cast<std::uint32_t>(sessions_.all_parked().size()));
    store.set_sessions(store.parked() + static_cast<std::uint32_t>(sessions_.all().size()));
    store.set_bytes(counts.bytes);
    store.set_log_bytes(counts.log_bytes);
    store.set_commits(counts.commits);
    store.set_changes(counts.changes);
    store.set_synced_commits(counts.synced_commits);
    store.set_fault(hub_.store->fault());
    store.set_warning(hub_.store->warning());
  }
  info.set_web(hub_.web.url);
  return info;
}

double Service::checked_seconds(double seconds, const char* field) {
  constexpr double kDay = 86400;
  if (!(seconds >= 0) || seconds > kDay)
    throw invalid(field, fmt::format("{} is not within a day", seconds));
  return seconds;
}

void Service::get_job(const proto::GetJobRequest& request, const SharedTicket& ticket) {
  if (request.wait_s() > 0) demand_room_to_wait(*ticket);
  hub_.jobs.get(request.job(), checked_seconds(request.wait_s(), "wait_s"), ticket);
}

void Service::shut_down(const proto::ShutdownRequest&, const SharedTicket& ticket) {
  if (hub_.options.shutdown_requests != ShutdownRequests::kAllowed) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "shutdown",
                  "This limberd was started without --allow-shutdown: clients cannot stop it; send "
                  "SIGTERM to its process.");
  }
  proto::Reply reply;
  reply.mutable_shutdown();
  ticket->answer(std::move(reply));
  request_stop_();
}

proto::ListJobsResponse Service::list_jobs(const proto::ListJobsRequest&) const {
  proto::ListJobsResponse response;
  for (const auto& job : hub_.jobs.list()) *response.add_jobs() = job;
  return response;
}

}  // namespace limber::server
