#pragma once

#include <functional>
#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

inline constexpr Milliseconds kLarge{60000};  // for answers that may be many megabytes

/// How a session is while it is waited for.
using WaitProgress = std::function<void(const v1::SessionStatus&)>;

/// The longest that a large answer is waited for.
[[nodiscard]] Milliseconds large(const Client& client);

/// Opens a scene and waits until it is built and solved.
/// @param session  its name; empty: chosen by the server
/// @returns NAME@UID, which never reaches another session of that name
/// @throws ClientError also with what the build failed with, TIMEOUT; the session is closed then
[[nodiscard]] std::string open_session(Client& client, const v1::Scene& scene,
                                       const std::string& session, Milliseconds timeout);

/// What a wait on a session is answered with. @param request  its timeout is put in
/// @param progress  told about twice a second while there is no answer; may be empty
/// @throws ClientError TIMEOUT; Unreachable within 8 s of when the server falls silent
[[nodiscard]] v1::ResultInfo wait_for_result(Client& client, v1::WaitRequest request,
                                             Milliseconds timeout, const WaitProgress& progress);

/// The final result of at least this revision, of a body with its motion_error: that is there a
/// moment after the final result itself. @throws ClientError TIMEOUT
[[nodiscard]] v1::ResultInfo wait_checked(Client& client, const std::string& session,
                                          std::uint64_t revision, Milliseconds timeout);

/// The final result of at least this revision. @throws ClientError TIMEOUT
[[nodiscard]] v1::ResultInfo wait_final(Client& client, const std::string& session,
                                        std::uint64_t revision, Milliseconds timeout);

}  // namespace limber::client
