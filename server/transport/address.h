#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/transport/role.h"

namespace limber::server {

/// Return path of a reply: the frames before the request's payload, sent back unchanged. The first
/// is the client's routing id; a REQ client adds an empty one, a DEALER need not; proxies add their
/// own.
struct Address {
  std::vector<std::string> envelope;
  std::uint64_t request_id =
      0;  // of the message, for replies that are made when the real one cannot be sent
  std::uint64_t local_peer =
      0;                    // its number, of a client that is no peer of the socket (LocalPeers)
  Role role = Role::kView;  // role of the client
  std::string key{};        // its CURVE public key; empty without CURVE
};

}  // namespace limber::server
