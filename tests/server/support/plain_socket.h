#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>

namespace limber::server::testing {

/// A TCP connection without ZeroMQ: sends any bytes.
class PlainSocket {
 public:
  /// @param endpoint  tcp://127.0.0.1:PORT
  explicit PlainSocket(const std::string& endpoint) : file_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    if (::connect(file_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      ADD_FAILURE() << "no connection to " << endpoint;
  }
  ~PlainSocket() { ::close(file_); }
  PlainSocket(const PlainSocket&) = delete;
  PlainSocket& operator=(const PlainSocket&) = delete;

  void send(const std::string& bytes) const {
    for (std::size_t at = 0; at < bytes.size();) {
      const auto sent = ::send(file_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (sent <= 0) return;  // cut off: receive_all() tells
      at += static_cast<std::size_t>(sent);
    }
  }

  /// So many bytes, or fewer where the server closed the connection or half a minute is over.
  [[nodiscard]] std::string receive(std::size_t count) const {
    std::string bytes(count, '\0');
    std::size_t at = 0;
    pollfd item{file_, POLLIN, 0};
    while (at<count&& ::poll(&item, 1, 30'000)> 0) {
      const auto got = ::recv(file_, bytes.data() + at, count - at, 0);
      if (got <= 0) break;
      at += static_cast<std::size_t>(got);
    }
    bytes.resize(at);
    return bytes;
  }

  struct Received {
    std::string bytes;
    bool closed = false;  // by the server
  };
  /// What comes until the server closes the connection, or nothing came for that time.
  [[nodiscard]] Received receive_all(std::chrono::milliseconds quiet) const {
    Received received;
    pollfd item{file_, POLLIN, 0};
    while (::poll(&item, 1, static_cast<int>(quiet.count())) > 0) {
      std::array<char, 4096> buffer{};
      const auto count = ::recv(file_, buffer.data(), buffer.size(), 0);
      if (count <= 0) {
        received.closed = true;
        break;
      }
      received.bytes.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return received;
  }

 private:
  int file_;
};

/// A message of one frame as ZMTP 1.0 writes it.
inline std::string zmtp1_frame(const std::string& payload) {
  return static_cast<char>(payload.size() + 1) + std::string(1, '\0') + payload;
}

/// What a page's `fetch(.., {method: 'POST', mode: 'no-cors', body})` sends, with a body that is
/// padded so that a reader of ZMTP 1.0 frames comes to `message`, for any reading of the headers.
inline std::string web_page_request(const std::string& message) {
  std::string text =
      "POST / HTTP/1.1\r\nHost: 127.0.0.1:7801\r\nConnection: keep-alive\r\n"
      "User-Agent: Mozilla/5.0 (X11; Linux x86_64)\r\nContent-Type: text/plain;charset=UTF-8\r\n"
      "Accept: */*\r\nOrigin: https://page.example\r\nContent-Length: 400\r\n\r\n";
  std::size_t frame = 0;
  while (frame < text.size()) frame += 1 + static_cast<unsigned char>(text[frame]);
  text += std::string(frame - text.size(), 'x');
  // One frame ends what the headers began, the next is the message.
  return text + zmtp1_frame("end") + zmtp1_frame(message);
}

}  // namespace limber::server::testing
