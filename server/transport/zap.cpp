#include "server/transport/zap.h"

#include <array>
#include <vector>
#include <zmq_addon.hpp>

#include "server/log/log.h"

namespace limber::server {
namespace {

constexpr const char* kStop = "inproc://limber.zap.stop";

}  // namespace

ZapHandler::ZapHandler(zmq::context_t& context, std::set<std::string> allowed, Counters& counters)
    : stop_(context, ZMQ_PAIR), allowed_(std::move(allowed)), counters_(counters) {
  zmq::socket_t handler(context, ZMQ_REP);
  handler.set(zmq::sockopt::linger, 0);
  handler.bind("inproc://zeromq.zap.01");
  zmq::socket_t stopped(context, ZMQ_PAIR);
  stopped.bind(kStop);
  stop_.connect(kStop);
  thread_ = std::thread([this, socket = std::move(handler), stop = std::move(stopped)]() mutable {
    std::array<zmq::pollitem_t, 2> items{
        {{socket.handle(), 0, ZMQ_POLLIN, 0}, {stop.handle(), 0, ZMQ_POLLIN, 0}}};
    while (true) {
      try {
        zmq::poll(items.data(), items.size(), std::chrono::milliseconds(-1));
        if ((items[1].revents & ZMQ_POLLIN) != 0) return;
        if ((items[0].revents & ZMQ_POLLIN) != 0) answer(socket);
      } catch (const zmq::error_t& fault) {
        if (fault.num() == ETERM) return;
        log::warn("zap: {}", fault.what());
      }
    }
  });
}

ZapHandler::~ZapHandler() {
  try {
    stop_.send(zmq::str_buffer("stop"), zmq::send_flags::dontwait);
  } catch (const zmq::error_t&) {  // the context is going down: the thread sees ETERM
  }
  thread_.join();
}

/// Request: version, request id, domain, address, identity, mechanism, client key (32 bytes).
/// Reply: version, request id, status code, status text, user id, metadata.
void ZapHandler::answer(zmq::socket_t& socket) {
  std::vector<zmq::message_t> request;
  if (!zmq::recv_multipart(socket, std::back_inserter(request))) return;
  const auto text = [&](std::size_t i) {
    return i < request.size() ? request[i].to_string() : std::string();
  };
  std::array<char, 41> key{};
  bool allowed = false;
  if (request.size() == 7 && text(5) == "CURVE" && request[6].size() == 32) {
    zmq_z85_encode(key.data(), request[6].data<std::uint8_t>(), 32);
    allowed = allowed_.count(key.data()) > 0;
  }
  if (!allowed) {
    counters_.refused_handshakes.fetch_add(1, std::memory_order_relaxed);
    log::warn("curve: refused a client at {} with key {}", text(3), key.data());
  }
  const std::array<std::string, 6> reply{"1.0",
                                         text(1),
                                         allowed ? "200" : "400",
                                         allowed ? "OK" : "key not on the allow list",
                                         allowed ? key.data() : "",
                                         ""};
  for (std::size_t i = 0; i < reply.size(); ++i) {
    socket.send(zmq::buffer(reply[i]),
                i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
  }
}

}  // namespace limber::server
