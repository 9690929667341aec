#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/runtime/attendance.h"
#include "server/runtime/ticket.h"

namespace limber::server {

/// The connections that have asked something, each with a number that is never given again. Any
/// thread.
class ClientDirectory {
 public:
  static constexpr std::size_t kMaxNameBytes = 64;

  /// On the transport's thread, of every request before anything of it is done.
  std::uint64_t note(const std::string& client);
  /// Its connection has ended. @returns its number, if it had one
  std::optional<std::uint64_t> remove(const std::string& client);
  /// Its number; 0: it has none.
  [[nodiscard]] std::uint64_t number_of(const std::string& client) const;
  /// The number may be of an earlier connection of this routing id.
  [[nodiscard]] bool is_connected(const std::string& client, std::uint64_t number) const;

  /// @param given  Request.client_name
  /// @throws Refusal INVALID_ARGUMENT naming client_name: too long, or control characters
  [[nodiscard]] static ClientIdentity identify(const Ticket& ticket, const std::string& given);
  /// Whose edits these are: of the key of CURVE, or else of the name. Empty: of a client without
  /// either.
  [[nodiscard]] static std::string author_of(const Ticket& ticket, const std::string& given);

 private:
  mutable std::mutex mutex_;
  std::unordered_map<std::string, std::uint64_t> numbers_;  // by routing id
  std::uint64_t last_ = 0;
};

}  // namespace limber::server
