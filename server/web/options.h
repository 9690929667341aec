#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace limber::server::web {

/// Whether messages are compressed (permessage-deflate), where the page offers it.
enum class Deflate { kOff, kOn };
/// Whether pages of other machines may connect: without encryption, unless a proxy adds it.
enum class Beyond { kRefused, kAllowed };

/// The gateway for pages: HTTP and WebSocket.
struct Options {
  std::string address = "127.0.0.1:8080";  // HOST:PORT, an IP address or localhost; PORT 0 for any
  Beyond beyond_loopback = Beyond::kRefused;
  std::filesystem::path root;        // files of this folder in place of those compiled in
  std::filesystem::path token_file;  // holds the token; empty: a random one is made
  std::vector<std::string> hosts;    // names of this server besides its addresses, without port
  std::vector<std::string>
      frame_ancestors;  // origins of pages that may embed ours, besides its own
  Deflate deflate = Deflate::kOff;
  std::size_t connections = 64;  // WebSockets at once, > 0
  // Limit for one WebSocket: stream messages that wait for it. One publication more may wait.
  std::uint64_t queue_bytes = 64ull << 20;
  std::uint64_t message_bytes = 256ull << 20;  // as TransportOptions::message_bytes
  std::chrono::seconds handshake{
      10};                         // for the head of an HTTP request, and for closing handshakes
  std::chrono::seconds idle{300};  // without a sign of life; pinged after half of it

  /// @throws Refusal naming the option
  void validate() const;
};

}  // namespace limber::server::web
