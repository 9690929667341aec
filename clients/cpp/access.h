#pragma once

#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

// Permissions on a server with CURVE keys. Each needs the role administer, and may throw
// ClientError as Client::call: PERMISSION_DENIED without it, FAILED_PRECONDITION if the server has
// no list of keys.

/// In the order of the list.
[[nodiscard]] v1::ListAllowedResponse list_allowed(Client& client);
/// Lets a key in, or gives it another role, from now on.
/// @param key   public key, 40 characters of Z85
/// @param name  whose it is, 1 to 64 of [A-Za-z0-9._@-]; empty: as it was
v1::AllowResponse allow(Client& client, const std::string& key, v1::Role role,
                        const std::string& name = "");
/// Takes a key off the list: its clients are disconnected when this returns.
/// @param key  the key, or its name in the list
v1::RevokeResponse revoke(Client& client, const std::string& key);

}  // namespace limber::client
