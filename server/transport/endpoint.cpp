#include "server/transport/endpoint.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

#include "engine/base/checked_number.h"

#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::string_view kTcp = "tcp://", kIpc = "ipc://", kInproc = "inproc://";

struct HostPort {
  std::string host, port;
};

bool is_port(const std::string& port) {
  if (port == "*") return true;
  return parse_number<std::uint16_t>(port).has_value();
}

HostPort split(const std::string& endpoint) {
  const std::string rest = endpoint.substr(kTcp.size());
  const auto colon = rest.rfind(':');
  if (colon == std::string::npos) return {};
  return {rest.substr(0, colon), rest.substr(colon + 1)};
}

bool is_loopback(const std::string& host) {
  if (host == "localhost") return true;
  in_addr four{};
  if (inet_pton(AF_INET, host.c_str(), &four) == 1) return (ntohl(four.s_addr) >> 24) == 127;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    in6_addr six{};
    return inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &six) == 1 &&
           IN6_IS_ADDR_LOOPBACK(&six);
  }
  return false;  // *, interface names, host names: they may reach further
}

}  // namespace

Reach reach_of(const std::string& endpoint, const std::string& field) {
  const auto starts = [&](std::string_view scheme) {
    return endpoint.size() > scheme.size() && endpoint.compare(0, scheme.size(), scheme) == 0;
  };
  if (starts(kIpc) || starts(kInproc)) return Reach::kLoopback;
  if (!starts(kTcp))
    throw invalid(field, fmt::format("'{}' is not tcp://HOST:PORT or ipc://PATH", endpoint));
  const HostPort parts = split(endpoint);
  if (parts.host.empty() || !is_port(parts.port)) {
    throw invalid(
        field, fmt::format("'{}' is not tcp://HOST:PORT (PORT 0 or * for any free one)", endpoint));
  }
  return is_loopback(parts.host) ? Reach::kLoopback : Reach::kBeyond;
}

std::string for_bind(const std::string& endpoint) {
  if (endpoint.compare(0, kTcp.size(), kTcp) != 0) return endpoint;
  const HostPort parts = split(endpoint);
  const bool any_port =
      std::all_of(parts.port.begin(), parts.port.end(), [](char c) { return c == '0'; });
  return fmt::format("{}{}:{}", kTcp, parts.host == "localhost" ? "127.0.0.1" : parts.host,
                     any_port ? "*" : parts.port);
}

}  // namespace limber::server
