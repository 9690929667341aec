#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/transport/role.h"

namespace limber::server::web {

/// The share of the common resources that pages of each role may take. Lesser roles leave a part to
/// greater ones, so that viewers cannot shut out editors, nor editors an administrator. One thread.
class Shares {
 public:
  /// @param places         WebSockets at once
  /// @param message_bytes  largest request; two of that size may be unfinished at once
  Shares(std::size_t places, std::uint64_t message_bytes);

  /// @returns whether there was a place
  [[nodiscard]] bool take_place(Role role);
  void leave_place(Role role);

  /// Bytes of messages that have not come whole, beyond the first kFreeBytes of each.
  /// @returns whether there was room: else nothing is taken
  [[nodiscard]] bool take_bytes(Role role, std::uint64_t bytes);
  void give_bytes_back(Role role, std::uint64_t bytes);

  /// Free bytes of each unfinished message, so that small requests always pass; also the largest
  /// message of a viewer.
  static constexpr std::uint64_t kFreeBytes = 1 << 20;
  [[nodiscard]] std::uint64_t largest_message(Role role) const;

 private:
  static constexpr std::size_t kRoles = 3;
  /// One kind of thing that is shared.
  struct Pool {
    std::array<std::uint64_t, kRoles> most{};  // of a role and the lesser ones together
    std::array<std::uint64_t, kRoles> taken{};

    [[nodiscard]] bool take(Role role, std::uint64_t amount);
    void give_back(Role role, std::uint64_t amount);
  };

  const std::uint64_t message_bytes_;
  Pool places_, bytes_;
};

}  // namespace limber::server::web
