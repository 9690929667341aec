#include "server/transport/local_peers.h"

#include <fmt/format.h>

#include <random>
#include <utility>

namespace limber::server {
namespace {

/// libzmq's own ids begin with a zero byte, too: none that a client has chosen for its socket does.
std::string random_client() {
  std::random_device random;  // of the operating system
  std::string client(1, '\0');
  client += "local ";
  for (int i = 0; i < 4; ++i) client += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
  return client;
}

}  // namespace

void LocalPeers::add(std::uint64_t number, std::shared_ptr<LocalPeer> peer, Role role) {
  peers_.insert_or_assign(number, Known{std::move(peer), random_client(), role});
}

std::string LocalPeers::remove(std::uint64_t number) {
  const auto found = peers_.find(number);
  if (found == peers_.end()) return {};
  std::string client = std::move(found->second.client);
  peers_.erase(found);
  return client;
}

LocalPeer* LocalPeers::find(std::uint64_t number) const {
  const auto found = peers_.find(number);
  return found == peers_.end() ? nullptr : found->second.peer.get();
}

Role LocalPeers::role_of(std::uint64_t number) const { return peers_.at(number).role; }

const std::string& LocalPeers::client_of(std::uint64_t number) const {
  return peers_.at(number).client;
}

void LocalPeers::publish(const std::string& topic, const SharedMessages& messages,
                         TopicSlots::Keep keep, const Subscriptions& subscriptions) const {
  for (const auto& [number, known] : peers_) {
    if (subscriptions.is_subscribed(number, topic)) known.peer->publish(topic, messages, keep);
  }
}

zmq::message_t message_of(std::string bytes) {
  auto* held = new std::string(std::move(bytes));
  return {held->data(), held->size(),
          [](void*, void* hint) { delete static_cast<std::string*>(hint); }, held};
}

zmq::message_t message_of(std::shared_ptr<const StreamBytes> bytes) {
  using Shared = std::shared_ptr<const StreamBytes>;
  auto* held = new Shared(std::move(bytes));
  // libzmq never writes into sent data.
  return {const_cast<char*>((*held)->data()), (*held)->size(),
          [](void*, void* hint) { delete static_cast<Shared*>(hint); }, held};
}

}  // namespace limber::server
