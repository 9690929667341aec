#include "clients/cpp/curve_keys.h"

#include <system_error>

#include "clients/cpp/files.h"

namespace limber::client {
namespace {

constexpr std::size_t kKeyLength = 40;

/// One Z85 key, white space around it aside. The message never shows what was read: it may be a
/// secret.
std::string read_key(const std::filesystem::path& path, const std::string& field) {
  const std::string text = read_bytes(path, field);
  const auto start = text.find_first_not_of(" \t\r\n");
  const auto end = text.find_last_not_of(" \t\r\n");
  const std::string key = start == std::string::npos ? "" : text.substr(start, end - start + 1);
  if (key.size() != kKeyLength || key.find_first_of(" \t\r\n") != std::string::npos)
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                      path.string() + " does not hold a CURVE key (40 characters of Z85)");
  return key;
}

}  // namespace

CurveKeys read_curve_keys(const std::string& server, const std::filesystem::path& key_file) {
  std::error_code ignored;
  const bool is_key = server.size() == kKeyLength && !std::filesystem::exists(server, ignored);
  return {is_key ? server : read_key(server, "server_key"),
          read_key(key_file.string() + ".pub", "key"), read_key(key_file, "key")};
}

}  // namespace limber::client
