#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace limber::server::web {

/// 128 random bits as hexadecimal digits.
[[nodiscard]] std::string make_token();

/// @param file  one line of 16 to 128 characters of A-Z a-z 0-9 - _; refused if others than the
/// owner may read it
/// @throws Error{kIo, kInvalidArgument} naming the file
[[nodiscard]] std::string read_token(const std::filesystem::path& file);

/// Takes the same time wherever they differ.
[[nodiscard]] bool is_same_token(std::string_view given, std::string_view token);

}  // namespace limber::server::web
