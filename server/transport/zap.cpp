#include "server/transport/zap.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <zmq_addon.hpp>

#include "engine/base/error.h"
#include "server/log/log.h"

namespace limber::server {
namespace {

constexpr const char* kStop = "inproc://limber.zap.stop";
constexpr const char* kDomain = "limber";

}  // namespace

ZapHandler::ZapHandler(zmq::context_t& context, std::optional<AllowedKeys> allowed,
                       Counters& counters, OnEnd on_end)
    : context_(context),
      handler_(context, ZMQ_REP),
      stop_(context, ZMQ_PAIR),
      stopped_(context, ZMQ_PAIR),
      counters_(counters),
      on_end_(std::move(on_end)),
      has_keys_(allowed.has_value()),
      allowed_(std::move(allowed).value_or(AllowedKeys())) {
  handler_.set(zmq::sockopt::linger, 0);
  handler_.bind("inproc://zeromq.zap.01");
  stopped_.bind(kStop);
  stop_.connect(kStop);
}

ZapHandler::~ZapHandler() {
  if (!thread_.joinable()) return;
  try {
    stop_.send(zmq::str_buffer("stop"), zmq::send_flags::dontwait);
  } catch (const zmq::error_t&) {  // the context is going down: the thread sees ETERM
  }
  thread_.join();
}

void ZapHandler::guard(zmq::socket_t& socket) { socket.set(zmq::sockopt::zap_domain, kDomain); }

void ZapHandler::watch(zmq::socket_t& socket) {
  const std::string address = fmt::format("inproc://limber.ends.{}", monitors_.size());
  if (zmq_socket_monitor(socket.handle(), address.c_str(), ZMQ_EVENT_DISCONNECTED) != 0)
    throw Error(ErrorCode::kInternal, "", "no socket monitor");
  zmq::socket_t monitor(context_, ZMQ_PAIR);
  monitor.set(zmq::sockopt::linger, 0);
  monitor.connect(address);
  monitors_.push_back(std::move(monitor));
}

void ZapHandler::stop_watching(zmq::socket_t& socket) {
  zmq_socket_monitor(socket.handle(), nullptr, 0);
}

void ZapHandler::start() {
  thread_ = std::thread([this] { run(); });
}

void ZapHandler::allow(AllowedKeys allowed) {
  const std::lock_guard lock(mutex_);
  allowed_ = std::move(allowed);
}

void ZapHandler::run() {
  std::vector<zmq::pollitem_t> items{{stopped_.handle(), 0, ZMQ_POLLIN, 0},
                                     {handler_.handle(), 0, ZMQ_POLLIN, 0}};
  for (auto& monitor : monitors_) items.push_back({monitor.handle(), 0, ZMQ_POLLIN, 0});
  while (true) {
    try {
      zmq::poll(items.data(), items.size(), std::chrono::milliseconds(-1));
      if ((items[0].revents & ZMQ_POLLIN) != 0) return;
      read_ends();
      if ((items[1].revents & ZMQ_POLLIN) != 0) answer();
    } catch (const zmq::error_t& fault) {
      if (fault.num() == ETERM) return;
      if (fault.num() != EINTR) log::warn("zap: {}", fault.what());
    } catch (const std::exception& fault) {
      log::error("zap: {}", fault.what());
    }
  }
}

/// Two frames: the event (16 bits) with its value (32 bits), here the descriptor; the endpoint.
void ZapHandler::read_ends() {
  for (auto& monitor : monitors_) {
    zmq::message_t event, endpoint;
    while (monitor.recv(event, zmq::recv_flags::dontwait)) {
      if (!monitor.recv(endpoint, zmq::recv_flags::dontwait) || event.size() != 6) continue;
      std::uint16_t kind = 0;
      std::int32_t value = 0;
      std::memcpy(&kind, event.data(), sizeof kind);
      std::memcpy(&value, event.data<char>() + sizeof kind, sizeof value);
      if (kind == ZMQ_EVENT_DISCONNECTED) on_end_({value, last_ + 1});
    }
  }
}

std::optional<std::string> ZapHandler::refusal_of(const std::vector<zmq::message_t>& request,
                                                  std::string& key) const {
  if (request.size() < 6 || request[2].to_string_view() != kDomain) return "not for this server";
  const std::string_view mechanism = request[5].to_string_view();
  if (!has_keys_ && mechanism == "NULL") return std::nullopt;
  if (!has_keys_ || mechanism != "CURVE" || request.size() != 7 || request[6].size() != 32)
    return "another mechanism";
  std::array<char, 41> text{};
  zmq_z85_encode(text.data(), request[6].data<std::uint8_t>(), 32);
  key = text.data();
  const std::lock_guard lock(mutex_);
  if (!allowed_.contains(key)) return "key not on the allow list";
  return std::nullopt;
}

/// Request: version, request id, domain, address, identity, mechanism, client key (32 bytes).
/// Reply: version, request id, status code, status text, user id, metadata.
void ZapHandler::answer() {
  std::vector<zmq::message_t> request;
  if (!zmq::recv_multipart(handler_, std::back_inserter(request), zmq::recv_flags::dontwait))
    return;
  const auto text = [&](std::size_t i) {
    return i < request.size() ? request[i].to_string() : std::string();
  };
  // Before a number is given: all that ended before this connection was made has a smaller one.
  read_ends();
  std::string key;
  const auto refusal = refusal_of(request, key);
  if (refusal) {
    counters_.refused_handshakes.fetch_add(1, std::memory_order_relaxed);
    log::warn("refused a client at {}: {} {}", text(3), *refusal, key);
  }
  const std::array<std::string, 6> reply{"1.0",
                                         text(1),
                                         refusal ? "400" : "200",
                                         refusal.value_or("OK"),
                                         refusal ? "" : user_id_of(++last_, key),
                                         ""};
  for (std::size_t i = 0; i < reply.size(); ++i) {
    handler_.send(zmq::buffer(reply[i]),
                  i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
  }
}

}  // namespace limber::server
