#include "server/transport/connections.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <string_view>

#include "engine/base/checked_number.h"

namespace limber::server {
namespace {

std::string_view property(zmq::message_t& message, const char* name) {
  const char* value = zmq_msg_gets(message.handle(), name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

}  // namespace

Peer peer_of(zmq::message_t& message) {
  Peer peer;
  const std::string_view user = property(message, "User-Id");
  const std::size_t blank = user.find(' ');
  if (const auto number = parse_number<std::uint64_t>(user.substr(0, blank))) {
    peer.number = *number;
    if (blank != std::string_view::npos) peer.key = user.substr(blank + 1);
  }
  // What ZMQ_SRCFD returns.
  if (const auto file = parse_number<int>(property(message, "__fd"))) peer.file = *file;
  return peer;
}

std::string user_id_of(std::uint64_t number, const std::string& key) {
  return key.empty() ? std::to_string(number) : fmt::format("{} {}", number, key);
}

Connections::State Connections::note(const Peer& peer) {
  if (peer.number == 0 || peer.file < 0) return State::kOpen;  // its end is not noticed
  const auto ended = ended_before_.find(peer.file);
  if (ended != ended_before_.end() && peer.number < ended->second) return State::kEnded;
  Known& known = by_file_[peer.file];
  if (known.peer.number != peer.number) known = {peer, {}};
  return State::kOpen;
}

bool Connections::note_client(const Peer& peer, const std::string& client) {
  if (note(peer) == State::kEnded || peer.number == 0 || peer.file < 0) return false;
  by_file_[peer.file].client = client;
  const auto [of_client, fresh] = of_clients_.try_emplace(client, peer.number);
  const bool replaced = !fresh && of_client->second != peer.number;
  of_client->second = peer.number;
  return replaced;
}

std::optional<Connections::Ended> Connections::end(const EndedConnections& ended) {
  ended_before_[ended.file] = ended.before;
  const auto known = by_file_.find(ended.file);
  if (known == by_file_.end() || known->second.peer.number >= ended.before) return std::nullopt;
  Ended found{known->second.peer.number, std::move(known->second.client)};
  by_file_.erase(known);
  const auto of_client = of_clients_.find(found.client);
  if (of_client != of_clients_.end() && of_client->second == found.number) {
    of_clients_.erase(of_client);
  } else {
    found.client.clear();
  }
  return found;
}

void Connections::cut_off(const Peer& peer) {
  if (peer.file >= 0) ::shutdown(peer.file, SHUT_RDWR);  // for a file that is no socket: ENOTSOCK
}

void Connections::cut_off(std::uint64_t number) const {
  for (const auto& [file, known] : by_file_) {
    if (known.peer.number == number) cut_off(known.peer);
  }
}

void Connections::cut_off_client(const std::string& client) const {
  const auto found = of_clients_.find(client);
  if (found != of_clients_.end()) cut_off(found->second);
}

std::size_t Connections::cut_off_others(const AllowedKeys& allowed) {
  std::size_t count = 0;
  for (const auto& [file, known] : by_file_) {
    if (allowed.contains(known.peer.key)) continue;
    cut_off(known.peer);
    ++count;
  }
  return count;
}

}  // namespace limber::server
