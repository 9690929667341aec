#pragma once

#include <string>
#include <string_view>

namespace limber::server {

/// A text of a client as messages repeat it: what is longer than `most` bytes is cut between
/// characters, and its length is stated.
[[nodiscard]] std::string abbreviate(std::string_view text, std::size_t most = 100);

}  // namespace limber::server
