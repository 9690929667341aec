#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace limber::server {

/// From a path that a client names to one that may be read. @throws Error with the field
using PathResolver =
    std::function<std::filesystem::path(const std::string& path, const std::string& field)>;

}  // namespace limber::server
