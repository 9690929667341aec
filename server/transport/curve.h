#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "server/transport/allow_list.h"

namespace limber::server {

/// A CurveZMQ key pair, each half 40 characters of Z85.
struct CurveKeys {
  std::string public_key, secret_key;
};

/// Keys for a socket beyond loopback: the server's secret and the clients that may connect.
struct CurveSetup {
  CurveKeys server;
  AllowedKeys allowed;
  std::filesystem::path allow_file;  // that holds them; empty: none, and they cannot be changed
};

[[nodiscard]] CurveKeys make_curve_keys();

/// Writes `path` (the secret, readable by its owner only) and `path`.pub; neither may exist. The
/// folder is made where it is missing, for its owner only.
/// @throws Error{kIo, kAlreadyExists}
void write_curve_keys(const std::filesystem::path& path, const CurveKeys& keys);

/// @param file  see AllowList
/// @throws Error{kIo, kInvalidArgument} naming the file and line
[[nodiscard]] AllowedKeys read_allowed_keys(const std::filesystem::path& file);

/// The key that a file of one has in its first line, before white space.
/// @param file  for errors
/// @throws Error{kInvalidArgument} naming the file
[[nodiscard]] std::string curve_key_of(const std::string& text, const std::string& file);

/// @param secret_file  one Z85 key; refused if other users may read it
/// @param allow_file   see read_allowed_keys()
/// @throws Error{kIo, kInvalidArgument} naming the file and line
[[nodiscard]] CurveSetup read_curve_setup(const std::filesystem::path& secret_file,
                                          const std::filesystem::path& allow_file);

}  // namespace limber::server
