#pragma once

#include <cstdint>
#include <string>

namespace limber::server {

/// Of the protocol: Request.version. The only one that this server speaks.
inline constexpr std::uint32_t kProtocolVersion = 1;

/// Of limberd, e.g. "0.1.0".
[[nodiscard]] const char* server_version();

/// "this server (0.1.0) does not know WHAT: update the server", of what a newer client sends.
[[nodiscard]] std::string unknown_here(const std::string& what);

/// The message to a client that uses another protocol: it names the side to update.
[[nodiscard]] std::string other_protocol(std::uint32_t version);

}  // namespace limber::server
