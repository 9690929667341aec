#pragma once

#include <cstdint>

namespace limber::server {

/// Memory that a session takes [bytes], estimated from its sizes: while it is built, rather too
/// high, and afterwards.
struct SessionMemory {
  std::uint64_t building = 0;
  std::uint64_t kept = 0;
};

}  // namespace limber::server
