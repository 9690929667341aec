#pragma once

#include <string>

namespace limber::server {

/// The name of an exported file without its ending.
/// @returns the fallback where the stem is empty
/// @throws Refusal with field stem unless it is made of [A-Za-z0-9._-] and starts with no dot
[[nodiscard]] std::string decode_file_stem(const std::string& stem, const std::string& fallback);

}  // namespace limber::server
