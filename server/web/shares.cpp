#include "server/web/shares.h"

#include <algorithm>

namespace limber::server::web {
namespace {

/// The share of all places that each role leaves to the next one. A page has two WebSockets.
std::size_t places_left(std::size_t places) {
  constexpr std::size_t kPage = 2, kFew = 8, kPart = 8;
  return places < kFew ? 0 : std::max(kPage, places / kPart);
}

std::size_t index_of(Role role) { return static_cast<std::size_t>(role); }

}  // namespace

Shares::Shares(std::size_t places, std::uint64_t message_bytes) : message_bytes_(message_bytes) {
  const std::size_t left = places_left(places);
  places_.most = {places - 2 * left, places - left, places};
  bytes_.most = {0, message_bytes, 2 * message_bytes};
}

bool Shares::take_place(Role role) { return places_.take(role, 1); }
void Shares::leave_place(Role role) { places_.give_back(role, 1); }
bool Shares::take_bytes(Role role, std::uint64_t bytes) { return bytes_.take(role, bytes); }
void Shares::give_bytes_back(Role role, std::uint64_t bytes) { bytes_.give_back(role, bytes); }

/// For roles that may send large ones: beyond the limit of a request there is room for an answer
/// that reports the error.
std::uint64_t Shares::largest_message(Role role) const {
  return role == Role::kView ? kFreeBytes : 2 * message_bytes_ + kFreeBytes;
}

/// Amounts of greater roles beyond their own part count, too.
bool Shares::Pool::take(Role role, std::uint64_t amount) {
  std::uint64_t sum = amount;
  for (std::size_t i = 0; i < kRoles; ++i) {
    sum += taken[i];
    if (i >= index_of(role) && sum > most[i]) return false;
  }
  taken[index_of(role)] += amount;
  return true;
}

void Shares::Pool::give_back(Role role, std::uint64_t amount) { taken[index_of(role)] -= amount; }

}  // namespace limber::server::web
