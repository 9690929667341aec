#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "server/transport/role.h"

namespace limber::server::web {

/// 128 random bits as hexadecimal digits.
[[nodiscard]] std::string make_token();

/// The token in a file: in its first line, 16 to 128 characters of A-Z a-z 0-9 - _.
/// @param file  for errors
/// @throws Error{kIo, kInvalidArgument} naming the file
[[nodiscard]] std::string token_of(const std::string& text, const std::string& file);

/// @param file  see token_of(); refused if other users may read it
/// @throws Error{kIo, kInvalidArgument} naming the file
[[nodiscard]] std::string read_token(const std::filesystem::path& file);

/// Tokens of pages, for each role. Those of the lesser roles follow from the one that administers,
/// by a hash that does not lead back: pages keep theirs when the server comes again.
class Tokens {
 public:
  /// @param token  of those that administer
  explicit Tokens(const std::string& token);
  [[nodiscard]] const std::string& of(Role role) const { return tokens_.at(role); }
  [[nodiscard]] const std::map<Role, std::string>& all() const { return tokens_; }
  /// The role of a page that shows this; nothing: it may not enter.
  [[nodiscard]] std::optional<Role> role_of(std::string_view given) const;

 private:
  std::map<Role, std::string> tokens_;
};

/// Takes the same time wherever they differ.
[[nodiscard]] bool is_same_token(std::string_view given, std::string_view token);

}  // namespace limber::server::web
