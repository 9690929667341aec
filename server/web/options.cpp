#include "server/web/options.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/transport/endpoint.h"
#include "server/web/door.h"
#include "server/wire/errors.h"

namespace limber::server::web {
namespace {

/// http://HOST, https://HOST:PORT and their like: what may stand in a Content-Security-Policy.
bool is_origin(const std::string& text) {
  const auto scheme = text.starts_with("http://")    ? text.substr(7)
                      : text.starts_with("https://") ? text.substr(8)
                                                     : std::string();
  return !scheme.empty() && std::all_of(scheme.begin(), scheme.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == ':' || c == '[' || c == ']' || c == '*';
  });
}

}  // namespace

void Options::validate() const {
  if (address.find("://") != std::string::npos)
    throw invalid("--web", fmt::format("'{}' is not ADDRESS:PORT", address));
  if (address.find(':') == std::string::npos)
    throw invalid("--web", fmt::format("'{}' is not ADDRESS:PORT, as 127.0.0.1:8080 is", address));
  if (reach_of("tcp://" + address, "--web") == server::Reach::kBeyond &&
      beyond_loopback == Beyond::kRefused) {
    throw invalid("--web",
                  fmt::format("{} reaches beyond this machine, where all that pages send can be "
                              "read, the token too: that needs --web-beyond-loopback",
                              address));
  }
  if (!root.empty() && !std::filesystem::is_directory(root))
    throw invalid("--web-root", root.string() + " is no folder");
  for (const auto& host : hosts) {
    if (host.empty() || host_name(host) != host)
      throw invalid("--web-host",
                    fmt::format("'{}' is no name of a host in lower case, without port", host));
  }
  for (const auto& origin : frame_ancestors) {
    if (!is_origin(origin))
      throw invalid("--web-frame-ancestor", fmt::format("'{}' is not http://HOST:PORT", origin));
  }
  if (connections == 0) throw invalid("--web-connections", "must be > 0");
  if (queue_bytes < (1u << 20)) throw invalid("--web-queue-bytes", "must be >= 1 MiB");
}

}  // namespace limber::server::web
