#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace limber::server::web {

/// Headers of every answer besides its own: names and values.
/// @param host  of the request, where it is one of this server's; else empty
/// @param frame_ancestors  origins of pages that may embed ours
[[nodiscard]] std::vector<std::pair<std::string, std::string>> security_headers(
    std::string_view host, const std::vector<std::string>& frame_ancestors);

}  // namespace limber::server::web
