#pragma once

#include <filesystem>
#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

/// Keys as `limberd keygen` writes them.
/// @param server    the server's public key: 40 characters of Z85, or a file that holds them
/// @param key_file  this client's secret key; its public key is in the file of the same name and
/// ".pub"
/// @throws ClientError IO, INVALID_ARGUMENT
[[nodiscard]] CurveKeys read_curve_keys(const std::string& server,
                                        const std::filesystem::path& key_file);

}  // namespace limber::client
