#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

#include "engine/base/error.h"

/// What libFuzzer calls for every input, and feed.cpp for every file. One definition in a program.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace limber::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return size == 0 ? std::string_view{}
                   : std::string_view{reinterpret_cast<const char*>(data), size};
}

/// Takes `input` up to `separator`, which goes, too; all of it where there is none.
inline std::string_view take_until(std::string_view& input, std::string_view separator) {
  const std::size_t end = input.find(separator);
  const std::string_view part = input.substr(0, end);
  input.remove_prefix(end == std::string_view::npos ? input.size() : end + separator.size());
  return part;
}

/// Takes a file's name, the first line; it ends at a zero byte, as a message that names it would.
inline std::string take_name(std::string_view& file) {
  std::string_view name = take_until(file, "\n").substr(0, 64);
  return std::string(name.substr(0, name.find('\0')));
}

[[noreturn]] inline void finding(const char* what) {
  std::fprintf(stderr, "finding: %s\n", what);
  std::abort();
}

/// Calls `read`. It may refuse with a limber::Error that has a message; whatever else it throws is
/// a finding: out of memory, an index out of range, an invariant that broke.
/// @returns whether it has read something
template <class Read>
bool reads(const Read& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal) finding(error.what());
    if (*error.what() == '\0') finding("an error without a message");
  } catch (const std::exception& fault) {
    finding(fault.what());
  }
  return false;
}

}  // namespace limber::fuzz
