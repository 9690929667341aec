#pragma once

#include <span>
#include <string_view>

namespace limber::server::web {

/// A file of clients/web/dist as it was when this program was built.
struct CompiledIn {
  const char* path;  // from the folder on, without / before it
  const char* begin;
  const char* end;
};

/// Made by cmake/LimberWebFiles.cmake. Empty where the folder was.
[[nodiscard]] std::span<const CompiledIn> compiled_in_files();

}  // namespace limber::server::web
