#include "server/web/token.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <random>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/string_generator.hpp>
#include <boost/uuid/uuid_io.hpp>

#include "engine/base/error.h"

namespace limber::server::web {
namespace {

constexpr std::size_t kShortest = 16, kLongest = 128;

bool is_token_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_';
}

}  // namespace

std::string make_token() {
  std::random_device random;  // of the operating system
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
  return token;
}

std::string token_of(const std::string& text, const std::string& file) {
  if (text.empty()) throw Error(ErrorCode::kIo, file, "cannot be read, or is empty");
  std::string token = text.substr(0, text.find('\n'));
  if (!token.empty() && token.back() == '\r') token.pop_back();
  if (token.size() < kShortest || token.size() > kLongest ||
      !std::all_of(token.begin(), token.end(), is_token_character))
    throw Error(
        ErrorCode::kInvalidArgument, file,
        fmt::format("the token is {} to {} characters of A-Z a-z 0-9 - _, in the first line",
                    kShortest, kLongest));
  return token;
}

std::string read_token(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
    throw Error(ErrorCode::kIo, file.string(), "is no file that can be read");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw Error(ErrorCode::kInvalidArgument, file.string(),
                fmt::format("others than its owner may read it: chmod 600 {}", file.string()));
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return token_of(line, file.string());
}

Tokens::Tokens(const std::string& token) {
  // A name space of our own (RFC 4122, version 5: SHA-1).
  const boost::uuids::uuid space =
      boost::uuids::string_generator()("6f0a4d0e-5f4b-4f0c-9f5e-0c7d1b6b2a11");
  const boost::uuids::name_generator_sha1 hash(space);
  for (const Role role : {Role::kView, Role::kEdit}) {
    const std::string name = fmt::format("limber page {} {}", name_of(role), token);
    tokens_.emplace(role, boost::uuids::to_string(hash(name)));
  }
  tokens_.emplace(Role::kAdminister, token);
}

std::optional<Role> Tokens::role_of(std::string_view given) const {
  std::optional<Role> found;
  for (const auto& [role, token] : tokens_) {  // all, so that the time does not tell which
    if (is_same_token(given, token)) found = role;
  }
  return found;
}

bool is_same_token(std::string_view given, std::string_view token) {
  unsigned difference = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char other = given.empty() ? '\0' : given[i % given.size()];
    difference |= static_cast<unsigned char>(other) ^ static_cast<unsigned char>(token[i]);
  }
  return difference == 0;
}

}  // namespace limber::server::web
