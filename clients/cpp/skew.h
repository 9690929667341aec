#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/cpp/error.h"

namespace limber::client {

/// Version of this library, e.g. "0.1.0".
[[nodiscard]] const char* client_version();

/// Message if no version of the protocol is common to both: it says which side is older.
/// @param spoken  by the server
[[nodiscard]] std::string other_protocol(const std::string& server_version,
                                         const std::vector<std::uint32_t>& spoken);

/// Does it refuse the field `client_version`, as servers do that are older than it?
[[nodiscard]] bool knows_no_client_version(const ClientError& error);

}  // namespace limber::client
