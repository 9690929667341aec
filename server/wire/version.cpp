#include "server/wire/version.h"

#include <fmt/format.h>

namespace limber::server {

const char* server_version() { return LIMBER_VERSION; }

std::string unknown_here(const std::string& what) {
  return fmt::format(
      "this server ({}) does not know {}: update the server, unless the bytes are damaged",
      server_version(), what);
}

std::string other_protocol(std::uint32_t version) {
  if (version == 0) {
    return fmt::format("the request names no protocol version; this server ({}) speaks {}",
                       server_version(), kProtocolVersion);
  }
  return fmt::format("this client speaks protocol {}, this server ({}) protocol {}: update the {}",
                     version, server_version(), kProtocolVersion,
                     version > kProtocolVersion ? "server" : "client");
}

}  // namespace limber::server
