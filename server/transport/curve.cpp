#include "server/transport/curve.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <array>
#include <sstream>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::server {
namespace {

constexpr std::size_t kKeyLength = 40;

bool is_key(std::string text) {
  std::array<std::uint8_t, 32> raw{};
  return text.size() == kKeyLength && zmq_z85_decode(raw.data(), text.c_str()) != nullptr;
}

/// The first word of a line, or nothing for an empty line and a comment. '#' is a Z85 digit too: a
/// word that is a key is one, also where it starts with '#'.
std::string first_word(const std::string& line) {
  constexpr const char* kBlanks = " \t\r";
  const auto first = line.find_first_not_of(kBlanks);
  if (first == std::string::npos) return {};
  const auto end = line.find_first_of(kBlanks, first);
  std::string word = line.substr(first, end == std::string::npos ? end : end - first);
  if (is_key(word)) return word;
  return line[first] == '#' ? std::string() : line;
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
        fmt::format("a secret key may be readable by its owner only (mode {:03o}; chmod 600)",
                    status.st_mode & 0777u));
  }
  std::istringstream in(scene::read_bytes(path));
  std::string line;
  std::getline(in, line);
  line = first_word(line);
  if (!is_key(line))
    throw Error(ErrorCode::kInvalidArgument, path.string(), "is not a Z85 key of 40 characters");
  return line;
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
  write_new_file(path.string() + ".pub", keys.public_key + "\n", 0644);
  write_new_file(path, keys.secret_key + "\n", 0600);
}

std::set<std::string> read_allowed_keys(const std::filesystem::path& file) {
  std::istringstream in(scene::read_bytes(file));
  std::set<std::string> keys;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = first_word(line);
    if (line.empty()) continue;
    if (!is_key(line)) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("{}:{}", file.string(), number),
                  "is not a Z85 public key of 40 characters");
    }
    keys.insert(line);
  }
  return keys;
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
  return setup;
}

}  // namespace limber::server
