#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/web/token.h"

namespace limber::server::web {

/// The head of an HTTP request, as far as it decides on access.
struct Visit {
  std::string_view method, target;
  std::string_view host;    // empty: none, or several
  std::string_view origin;  // empty: none
  bool has_many_origins = false;
  bool is_upgrade = false;         // to a WebSocket
  std::string_view local_address;  // that the connection reached, e.g. 127.0.0.1 or ::1
};

/// What is done with it.
struct Verdict {
  enum class Way { kFile, kProbe, kRequests, kStream, kRefused };
  Way way = Way::kRefused;
  unsigned status = 400;    // of a refusal
  std::string text;         // of a refusal, a sentence for a person
  std::string path;         // of a file or probe, begins with /
  Role role = Role::kView;  // of a page: that of its token
};

/// Decides on access, and to which parts.
class Door {
 public:
  /// @param token  of pages that administer, see Tokens
  /// @param hosts  names of this server besides its addresses
  Door(const std::string& token, std::vector<std::string> hosts)
      : tokens_(token), hosts_(std::move(hosts)) {}

  [[nodiscard]] Verdict judge(const Visit& visit) const;
  [[nodiscard]] const Tokens& tokens() const { return tokens_; }

 private:
  [[nodiscard]] bool is_own_host(std::string_view host, std::string_view local_address) const;

  const Tokens tokens_;
  const std::vector<std::string> hosts_;
};

/// Whether `origin` (http://HOST:PORT, or https of a proxy) is that of pages of `host` (HOST:PORT).
[[nodiscard]] bool is_own_origin(std::string_view origin, std::string_view host);

/// The part of HOST:PORT, HOST, [V6]:PORT before the port, in lower case and without brackets;
/// empty where it is none, or the port no number.
[[nodiscard]] std::string host_name(std::string_view host);

/// The value of a parameter of a target PATH?NAME=VALUE&..., as written; empty if it is absent.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view name);

}  // namespace limber::server::web
