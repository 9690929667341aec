#include "server/web/headers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace limber::server::web {

std::vector<std::pair<std::string, std::string>> security_headers(
    std::string_view host, const std::vector<std::string>& frame_ancestors) {
  // Not every browser takes 'self' for WebSockets of the same place.
  const std::string sockets = host.empty() ? "" : fmt::format(" ws://{0} wss://{0}", host);
  const std::string ancestors =
      frame_ancestors.empty() ? "" : fmt::format(" {}", fmt::join(frame_ancestors, " "));
  return {{"Content-Security-Policy",
           fmt::format("default-src 'self'; connect-src 'self'{}; img-src 'self' blob: data:; "
                       "media-src 'self' blob:; worker-src 'self' blob:; object-src 'none'; "
                       "base-uri 'none'; form-action 'none'; frame-ancestors 'self'{}",
                       sockets, ancestors)},
          {"X-Content-Type-Options", "nosniff"},
          {"Referrer-Policy", "no-referrer"},
          {"Cross-Origin-Resource-Policy", "same-origin"},
          {"Cross-Origin-Opener-Policy", "same-origin"}};
}

}  // namespace limber::server::web
