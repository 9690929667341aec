#pragma once

#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

inline constexpr Milliseconds kLarge{120000};  // for answers that may be many megabytes

/// The longest that a large answer is waited for.
[[nodiscard]] Milliseconds large(const Client& client);

/// Opens a scene; its build goes on in a job. @param session  its name; empty: chosen by the server
[[nodiscard]] v1::OpenSessionResponse begin_session(Client& client, v1::Scene scene,
                                                    const std::string& session);

/// Opens a scene and waits until it is built and solved.
/// @param session  its name; empty: chosen by the server
/// @returns NAME@UID, which never reaches another session of that name
/// @throws ClientError also of the build's failure, TIMEOUT; the session is closed then
[[nodiscard]] std::string open_session(Client& client, const v1::Scene& scene,
                                       const std::string& session, Milliseconds timeout);

}  // namespace limber::client
