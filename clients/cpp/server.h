#pragma once

#include <cstdint>
#include <string>

#include "clients/cpp/client.h"
#include "clients/cpp/opening.h"

namespace limber::client {

// Requests of the server, of no session. Each may throw ClientError as Client::call.

[[nodiscard]] v1::GetServerInfoResponse server_info(Client& client);
/// With `status`: how it does, and each of its sessions.
[[nodiscard]] v1::GetServerInfoResponse server_status(Client& client);
[[nodiscard]] v1::ListSessionsResponse list_sessions(Client& client);
[[nodiscard]] v1::ListJobsResponse list_jobs(Client& client);
/// A sample's scene. @param name  empty: the names of all in its place
[[nodiscard]] v1::GetSampleResponse sample(Client& client, const std::string& name = "");
/// A stored session with its edits, as one file has it.
[[nodiscard]] v1::SaveSessionResponse save_session(Client& client, const std::string& session);
/// @param content  of such a file. @param name  empty: the one that it had
v1::RestoreSessionResponse restore_session(Client& client, std::string content,
                                           const std::string& name = "");
/// Stops a job that runs.
v1::CancelResponse cancel_job(Client& client, std::uint64_t job);
/// Ends limberd; never sent twice.
v1::ShutdownResponse shut_down(Client& client);

/// Begins the requested job. @returns the job, for wait_job()
template <class Request>
[[nodiscard]] std::uint64_t start_job(Client& client, const Request& request) {
  return client.call(request, large(client)).job();
}

}  // namespace limber::client
