#include "clients/cpp/skew.h"

#include <algorithm>

#include "clients/cpp/client.h"

namespace limber::client {

const char* client_version() { return LIMBER_VERSION; }

std::string other_protocol(const std::string& server_version,
                           const std::vector<std::uint32_t>& spoken) {
  std::string list;
  for (const auto version : spoken) list += (list.empty() ? "" : ", ") + std::to_string(version);
  const bool is_newer = std::any_of(spoken.begin(), spoken.end(),
                                    [](auto version) { return version > kProtocolVersion; });
  return "limberd " + server_version + " speaks protocol " + list + ", this client (" +
         client_version() + ") protocol " + std::to_string(kProtocolVersion) + ": update the " +
         (is_newer ? "client" : "server");
}

bool knows_no_client_version(const ClientError& error) {
  return error.code() == v1::ERROR_CODE_INVALID_ARGUMENT &&
         std::string(error.what()).find("GetServerInfoRequest") != std::string::npos;
}

}  // namespace limber::client
