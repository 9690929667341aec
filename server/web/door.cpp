#include "server/web/door.h"

#include <arpa/inet.h>

#include <algorithm>
#include <utility>

namespace limber::server::web {
namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

bool is_host_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_' ||
         c == ':';
}

bool is_port(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool is_loopback_name(const std::string& name) {
  if (name == "localhost") return true;
  in_addr four{};
  if (inet_pton(AF_INET, name.c_str(), &four) == 1) return (ntohl(four.s_addr) >> 24) == 127;
  in6_addr six{};
  return inet_pton(AF_INET6, name.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six);
}

std::string_view path_of(std::string_view target) { return target.substr(0, target.find('?')); }

Verdict refused(unsigned status, std::string text) {
  return {Verdict::Way::kRefused, status, std::move(text), {}};
}

}  // namespace

std::string host_name(std::string_view host) {
  std::string name = lower(host), rest;
  if (name.starts_with('[')) {
    const auto end = name.find(']');
    if (end == std::string::npos) return {};
    rest = name.substr(end + 1);
    name = name.substr(1, end - 1);
  } else {
    const auto end = std::min(name.size(), name.find(':'));
    rest = name.substr(end);
    name.resize(end);
  }
  // All of it is repeated in a header of the answer.
  if (!rest.empty() && (rest.front() != ':' || !is_port(std::string_view(rest).substr(1))))
    return {};
  return std::all_of(name.begin(), name.end(), is_host_character) ? name : std::string();
}

bool is_own_origin(std::string_view origin, std::string_view host) {
  const std::string given = lower(origin);
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (given.starts_with(scheme))
      return std::string_view(given).substr(scheme.size()) == lower(host);
  }
  return false;
}

std::string_view query_value(std::string_view target, std::string_view name) {
  const auto question = target.find('?');
  std::string_view rest = question == std::string_view::npos ? "" : target.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    if (pair.size() > name.size() && pair.starts_with(name) && pair[name.size()] == '=')
      return pair.substr(name.size() + 1);
  }
  return {};
}

bool Door::is_own_host(std::string_view host, std::string_view local_address) const {
  const std::string name = host_name(host);
  if (name.empty()) return false;
  return is_loopback_name(name) || name == local_address ||
         std::find(hosts_.begin(), hosts_.end(), name) != hosts_.end();
}

Verdict Door::judge(const Visit& visit) const {
  // A page of another site whose name was made to resolve to this machine sends its own name.
  if (!is_own_host(visit.host, visit.local_address))
    return refused(403, "This is not a name of this server (Host); see limberd --web-host.");
  if (visit.has_many_origins || (!visit.origin.empty() && !is_own_origin(visit.origin, visit.host)))
    return refused(403, "Pages of other origins are not let in (Origin).");
  if (!visit.target.starts_with('/')) return refused(400, "The target is no path.");
  const std::string_view path = path_of(visit.target);
  const bool is_requests = path == "/v1/requests";
  if (is_requests || path == "/v1/stream") {
    if (visit.method != "GET") return refused(405, "WebSockets are opened by GET.");
    const auto role = tokens_.role_of(query_value(visit.target, "token"));
    if (!role)
      return refused(401,
                     "The token is wrong or missing: `limber web` prints the address with it.");
    if (!visit.is_upgrade)
      return refused(426, "The token is right; this is the place of a WebSocket.");
    return {is_requests ? Verdict::Way::kRequests : Verdict::Way::kStream, 101, {}, {}, *role};
  }
  if (visit.method != "GET" && visit.method != "HEAD")
    return refused(405, "Files are read, by GET or HEAD.");
  if (visit.is_upgrade) return refused(404, "There is no WebSocket here.");
  if (path == "/healthz" || path == "/readyz" || path == "/metrics")
    return {Verdict::Way::kProbe, 200, {}, std::string(path)};
  return {Verdict::Way::kFile, 200, {}, std::string(path)};
}

}  // namespace limber::server::web
