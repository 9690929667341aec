#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace limber::scene::formats {

using Json = nlohmann::json;

/// The object that a text is.
/// @param refuse  is called with why it is none, and does not return
[[nodiscard]] Json parse_object(std::string_view text,
                                const std::function<void(const std::string&)>& refuse);

}  // namespace limber::scene::formats
