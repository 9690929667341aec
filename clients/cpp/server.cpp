#include "clients/cpp/server.h"

#include <utility>

namespace limber::client {

v1::GetServerInfoResponse server_info(Client& client) {
  return client.call(v1::GetServerInfoRequest{});
}

v1::GetServerInfoResponse server_status(Client& client) {
  v1::GetServerInfoRequest request;
  request.set_with_status(true);
  return client.call(request);
}

v1::ListSessionsResponse list_sessions(Client& client) {
  return client.call(v1::ListSessionsRequest{});
}

v1::ListJobsResponse list_jobs(Client& client) { return client.call(v1::ListJobsRequest{}); }

v1::GetSampleResponse sample(Client& client, const std::string& name) {
  v1::GetSampleRequest request;
  request.set_name(name);
  return client.call(request, large(client));
}

v1::SaveSessionResponse save_session(Client& client, const std::string& session) {
  v1::SaveSessionRequest request;
  request.set_session(session);
  return client.call(request, large(client));
}

v1::RestoreSessionResponse restore_session(Client& client, std::string content,
                                           const std::string& name) {
  v1::RestoreSessionRequest request;
  request.set_content(std::move(content));
  request.set_session(name);
  return client.call(request, large(client));
}

v1::CancelResponse cancel_job(Client& client, std::uint64_t job) {
  v1::CancelRequest request;
  request.set_job(job);
  return client.call(request);
}

v1::ShutdownResponse shut_down(Client& client) { return client.call(v1::ShutdownRequest{}); }

}  // namespace limber::client
