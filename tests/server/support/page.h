#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "limber/v1/service.pb.h"
#include "server/service/server.h"
#include "tests/server/support/plain_socket.h"

namespace limber::server::testing {

/// A WebSocket of a page, by a plain connection.
class Page {
 public:
  /// @param path  /v1/requests or /v1/stream
  Page(const WebEntrance& web, const std::string& path) : socket_(web.url) {
    const std::string host = web.url.substr(std::string("http://").size());
    socket_.send("GET " + path + "?token=" + web.token + " HTTP/1.1\r\nHost: " + host +
                 "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                 "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
    std::string head;
    while (!head.ends_with("\r\n\r\n")) {
      const std::string next = socket_.receive(1);
      if (next.empty()) break;
      head += next;
    }
    EXPECT_TRUE(head.starts_with("HTTP/1.1 101 ")) << head;
  }

  void send(const std::string& bytes) const {
    std::string frame(1, '\x82');  // binary, whole
    if (bytes.size() < 126) {
      frame += static_cast<char>(0x80 | bytes.size());
    } else {
      frame += '\xfe';
      frame += static_cast<char>(bytes.size() >> 8);
      frame += static_cast<char>(bytes.size() & 0xff);
    }
    socket_.send(frame + std::string(4, '\0') + bytes);  // a mask of zeros
  }

  struct Frame {
    int kind = 0;  // 2: a message, 8: the end
    std::string bytes;
  };
  /// Nothing: the connection has ended.
  [[nodiscard]] std::optional<Frame> receive() const {
    const std::string head = socket_.receive(2);
    if (head.size() < 2) return std::nullopt;
    std::size_t size = static_cast<unsigned char>(head[1]);
    if (size >= 126) {
      const std::size_t digits = size == 126 ? 2 : 8;
      const std::string length = socket_.receive(digits);
      size = 0;
      for (const char c : length) size = size << 8 | static_cast<unsigned char>(c);
    }
    return Frame{head[0] & 0x0f, socket_.receive(size)};
  }

  std::uint64_t ask(v1::Request request) {
    request.set_version(1);
    request.set_id(++last_);
    send(request.SerializeAsString());
    return last_;
  }
  v1::Reply reply() const {
    v1::Reply reply;
    const auto frame = receive();
    if (!frame || frame->kind != 2 || !reply.ParseFromString(frame->bytes))
      ADD_FAILURE() << "no reply";
    return reply;
  }

 private:
  PlainSocket socket_;
  std::uint64_t last_ = 0;
};

}  // namespace limber::server::testing
