#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace limber::server {

/// Bytes by their difference from others, as StoredSnapshot has them: pieces of three varints, so
/// many bytes of `before`, from that byte on, and so many new ones, which follow. Takes about as
/// long as reading both, and little room where much of `after` is somewhere in `before`.
[[nodiscard]] std::string difference_of(std::string_view before, std::string_view after);
/// @param most  bytes that the result may have
/// @throws Refusal MALFORMED where it is no difference from these bytes, or leads to more
[[nodiscard]] std::string with_difference(std::string_view before, std::string_view difference,
                                          std::size_t most);

}  // namespace limber::server
