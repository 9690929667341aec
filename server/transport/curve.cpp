#include "server/transport/curve.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "server/log/log.h"

namespace limber::server {
namespace {

constexpr std::size_t kKeyLength = 40;

/// With those above it that are missing.
void make_private_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (folder.empty() || std::filesystem::exists(folder, ignored)) return;
  make_private_folder(folder.parent_path());
  ::mkdir(folder.c_str(), 0700);  // where it cannot be made, no file can be in it
}

void write_new_file(const std::filesystem::path& path, const std::string& content, mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) {
    const auto code = errno == EEXIST ? ErrorCode::kAlreadyExists : ErrorCode::kIo;
    throw Error(code, path.string(), "the file cannot be created, or exists already");
  }
  const auto written = ::write(file, content.data(), content.size());
  ::close(file);
  if (written != static_cast<ssize_t>(content.size()))
    throw Error(ErrorCode::kIo, path.string(), "cannot be written");
}

std::string read_secret(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0)
    throw Error(ErrorCode::kIo, path.string(), "cannot be read");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw Error(
        ErrorCode::kInvalidArgument, path.string(),
        fmt::format("others than its owner may read this secret key (mode {:03o}): chmod 600 {}",
                    status.st_mode & 0777u, path.string()));
  }
  return curve_key_of(scene::read_bytes(path), path.string());
}

}  // namespace

CurveKeys make_curve_keys() {
  std::array<char, kKeyLength + 1> open{}, secret{};
  if (zmq_curve_keypair(open.data(), secret.data()) != 0) {
    throw Error(ErrorCode::kUnsupported, "", "this libzmq was built without CURVE");
  }
  return {open.data(), secret.data()};
}

void write_curve_keys(const std::filesystem::path& path, const CurveKeys& keys) {
  make_private_folder(path.parent_path());
  write_new_file(path.string() + ".pub", keys.public_key + "\n", 0644);
  write_new_file(path, keys.secret_key + "\n", 0600);
}

std::string curve_key_of(const std::string& text, const std::string& file) {
  std::istringstream words(text.substr(0, text.find('\n')));
  std::string key;
  words >> key;
  if (!is_curve_key(key))
    throw Error(ErrorCode::kInvalidArgument, file, "is not a Z85 key of 40 characters");
  return key;
}

AllowedKeys read_allowed_keys(const std::filesystem::path& file) {
  return read_allow_list(file).keys();
}

CurveSetup read_curve_setup(const std::filesystem::path& secret_file,
                            const std::filesystem::path& allow_file) {
  CurveSetup setup;
  setup.server.secret_key = read_secret(secret_file);
  std::array<char, kKeyLength + 1> open{};
  if (zmq_curve_public(open.data(), setup.server.secret_key.c_str()) != 0) {
    throw Error(ErrorCode::kInvalidArgument, secret_file.string(), "has no public key");
  }
  setup.server.public_key = open.data();
  setup.allowed = read_allowed_keys(allow_file);
  setup.allow_file = allow_file;
  const bool is_administered =
      std::any_of(setup.allowed.begin(), setup.allowed.end(),
                  [](const auto& entry) { return entry.second.role == Role::kAdminister; });
  if (!is_administered) {
    log::warn("no key in {0} administers: `limber allow KEY --role administer --file {0}`",
              allow_file.string());
  }
  return setup;
}

}  // namespace limber::server
