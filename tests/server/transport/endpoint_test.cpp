#include "server/transport/endpoint.h"

#include <gtest/gtest.h>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

TEST(Endpoint, Loopback) {
  for (const char* endpoint : {"tcp://127.0.0.1:7801", "tcp://127.1.2.3:*", "tcp://localhost:0",
                               "tcp://[::1]:7801", "ipc:///tmp/x", "inproc://x"}) {
    EXPECT_EQ(reach_of(endpoint, "--bind"), Reach::kLoopback) << endpoint;
  }
}

TEST(Endpoint, Beyond) {
  for (const char* endpoint :
       {"tcp://0.0.0.0:7801", "tcp://*:7801", "tcp://eth0:7801", "tcp://192.168.1.5:1",
        "tcp://[::]:7801", "tcp://128.0.0.1:1", "tcp://127.0.0.1.example.org:1",
        "tcp://localhost.example.org:1", "tcp://[::ffff:127.0.0.1]:1"}) {
    EXPECT_EQ(reach_of(endpoint, "--bind"), Reach::kBeyond) << endpoint;
  }
}

TEST(Endpoint, NoEndpoint) {
  for (const char* endpoint :
       {"", "tcp://", "tcp://127.0.0.1", "tcp://:1", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:x",
        "tcp://127.0.0.1:-1", "udp://127.0.0.1:1", "127.0.0.1:7801", "ipc://"}) {
    EXPECT_THROW((void)reach_of(endpoint, "--bind"), Refusal) << endpoint;
  }
}

TEST(Endpoint, ForBind) {
  EXPECT_EQ(for_bind("tcp://localhost:0"), "tcp://127.0.0.1:*");
  EXPECT_EQ(for_bind("tcp://127.0.0.1:7801"), "tcp://127.0.0.1:7801");
  EXPECT_EQ(for_bind("tcp://[::1]:0"), "tcp://[::1]:*");
  EXPECT_EQ(for_bind("ipc:///x:0"), "ipc:///x:0");
}

}  // namespace
}  // namespace limber::server
