#pragma once

#include <string>

namespace limber::server {

enum class Reach {
  kLoopback,  // tcp on 127.0.0.0/8, ::1 or localhost; ipc; inproc
  kBeyond,    // any other tcp address: other machines may connect
};

/// How far an endpoint to bind reaches. tcp://HOST:PORT with PORT 0 or * for any free one,
/// ipc://PATH, inproc://NAME.
/// @throws Refusal INVALID_ARGUMENT naming `field` for anything else
[[nodiscard]] Reach reach_of(const std::string& endpoint, const std::string& field);

/// The endpoint as libzmq wants it (port 0 is written *, localhost 127.0.0.1).
[[nodiscard]] std::string for_bind(const std::string& endpoint);

}  // namespace limber::server
