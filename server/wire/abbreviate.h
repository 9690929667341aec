#pragma once

#include <string>
#include <string_view>

namespace limber::server {

/// A client's text as messages repeat it: beyond `most` bytes it is cut between characters, and its
/// length is stated.
[[nodiscard]] std::string abbreviate(std::string_view text, std::size_t most = 100);

}  // namespace limber::server
