#pragma once

#include <filesystem>
#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

/// Keys as `limberd keygen` writes them.
/// @param server    the server's public key: 40 characters of Z85, or a file that holds them
/// @param key_file  this client's secret key; its public key is in the file of the same name and
/// ".pub"
/// @throws ClientError IO, INVALID_ARGUMENT Refused if other users may read the secret key.
[[nodiscard]] CurveKeys read_curve_keys(const std::string& server,
                                        const std::filesystem::path& key_file);

/// A client's public key.
/// @param given  40 characters of Z85; or the file that holds it, or that of its secret key, with
/// the public one in FILE.pub
/// @throws ClientError IO, INVALID_ARGUMENT with this field
[[nodiscard]] std::string public_key(const std::string& given, const std::string& field);
/// Is it a file, and no key as text?
[[nodiscard]] bool is_key_file(const std::string& given);

}  // namespace limber::client
