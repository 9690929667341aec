#pragma once

#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

/// How far a connection gets where no answer came.
enum class Reach {
  kNobody,       // nothing accepts connections there
  kNoHandshake,  // something does, but not this client: keys do not fit, or it is no limberd
  kHandshake,    // a socket of ours is let in; limberd is busy or hangs
  kNoSuchPlace,  // the name of the host is not known, or the port is none
};

/// Tries a connection of its own. Takes up to `patience` where something listens that says nothing.
[[nodiscard]] Reach probe(Client& client, Milliseconds patience = Milliseconds{500});

/// Advice for the user, a sentence without its full stop; for a client with or without keys.
[[nodiscard]] std::string advice(Reach reach, const Client& client);

}  // namespace limber::client
