#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "engine/base/error.h"

namespace limber::server {

/// From a path that a client names to one that may be read. @throws Error with the field
using PathResolver =
    std::function<std::filesystem::path(const std::string& path, const std::string& field)>;

/// Readers name files and lines in their messages; the field is where the client gave the source.
template <class Read>
auto read_at(const std::string& field, const Read& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw Error(error.code(), field, error.what());
  }
}

}  // namespace limber::server
