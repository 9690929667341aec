#pragma once

#include <span>
#include <string_view>

namespace limber {

/// The name that a misspelt one most likely means: the one with the fewest letters inserted,
/// removed, replaced or swapped with their neighbour, at most a third of them. Upper and lower
/// case, blanks, hyphens and underscores count as equal. Empty if no name is that near; the first
/// of equally near ones.
[[nodiscard]] std::string_view nearest_name(std::string_view misspelt,
                                            std::span<const std::string_view> names);

}  // namespace limber
