#include "server/service/client_directory.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/wire/errors.h"

namespace limber::server {

std::uint64_t ClientDirectory::note(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto [known, is_new] = numbers_.try_emplace(client, last_ + 1);
  if (is_new) ++last_;
  return known->second;
}

std::optional<std::uint64_t> ClientDirectory::remove(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto known = numbers_.find(client);
  if (known == numbers_.end()) return std::nullopt;
  const std::uint64_t number = known->second;
  numbers_.erase(known);
  return number;
}

std::uint64_t ClientDirectory::number_of(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto known = numbers_.find(client);
  return known == numbers_.end() ? 0 : known->second;
}

bool ClientDirectory::is_connected(const std::string& client, std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto known = numbers_.find(client);
  return known != numbers_.end() && known->second == number;
}

ClientIdentity ClientDirectory::identify(const Ticket& ticket, const std::string& given) {
  if (given.size() > kMaxNameBytes) {
    throw invalid("client_name",
                  fmt::format("{} bytes, at most {} are allowed", given.size(), kMaxNameBytes));
  }
  const auto is_control = [](unsigned char byte) { return byte < 0x20 || byte == 0x7f; };
  if (std::any_of(given.begin(), given.end(), is_control))
    throw invalid("client_name", "a name has no control characters");
  const std::uint64_t number = ticket.client_number();
  if (!given.empty()) return {number, given};
  const char* const kind = ticket.way() == Ticket::Way::kLocalPeer ? "page" : "client";
  return {number, fmt::format("{}-{}", kind, number)};
}

std::string ClientDirectory::author_of(const Ticket& ticket, const std::string& given) {
  return ticket.key().empty() ? given : ticket.key();
}

}  // namespace limber::server
