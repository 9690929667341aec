#include "clients/cpp/curve_keys.h"

#include <sys/stat.h>

#include <system_error>

#include "clients/cpp/files.h"

namespace limber::client {
namespace {

constexpr std::size_t kKeyLength = 40;

/// One Z85 key, white space around it aside. The message never shows the content: it may be a
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

enum class Readers { kNoFile, kOwner, kOthers };
Readers readers_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return Readers::kNoFile;
  return (status.st_mode & (S_IRWXG | S_IRWXO)) == 0 ? Readers::kOwner : Readers::kOthers;
}

/// Refuses files that other users may read: they are not secret.
void demand_private(const std::filesystem::path& path, const std::string& field) {
  if (readers_of(path) != Readers::kOthers) return;
  throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                    "others than its owner may read the secret key " + path.string() +
                        ": chmod 600 " + path.string());
}

}  // namespace

bool is_key_file(const std::string& given) {
  std::error_code ignored;
  return std::filesystem::exists(given, ignored);
}

std::string public_key(const std::string& given, const std::string& field) {
  if (!is_key_file(given)) {
    if (given.size() == kKeyLength) return given;
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                      "'" + given + "' is neither a CURVE key (40 characters of Z85) nor a file");
  }
  if (is_key_file(given + ".pub")) return read_key(given + ".pub", field);
  // Only its owner may read it: a secret key looks the same, and would be sent.
  if (!given.ends_with(".pub") && readers_of(given) == Readers::kOwner)
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                      given + " may hold a secret key: give FILE.pub, or the public key itself");
  return read_key(given, field);
}

CurveKeys read_curve_keys(const std::string& server, const std::filesystem::path& key_file) {
  const bool is_key = server.size() == kKeyLength && !is_key_file(server);
  demand_private(key_file, "key");
  return {is_key ? server : read_key(server, "server_key"),
          read_key(key_file.string() + ".pub", "key"), read_key(key_file, "key")};
}

}  // namespace limber::client
