#include "server/store/row_seal.h"

#include <fmt/format.h>

#include "engine/base/hash.h"

namespace limber::server::store {
namespace {

using namespace std::string_view_literals;

/// Tag of field 1000 as bytes, their number, and the name of the hash: no row ends so by chance.
constexpr std::string_view kMark = "\xc2\x3e\x0cxxh3"sv;
constexpr std::size_t kHashBytes = 8, kSealBytes = kMark.size() + kHashBytes;

}  // namespace

std::string seal_of(std::initializer_list<std::string_view> values) {
  ContentHash hash;
  for (const std::string_view value : values) hash.add(value);
  const auto digest = hash.digest();
  return {digest.begin(), digest.begin() + kHashBytes};
}

std::string place_of(const char* table, std::uint64_t uid, std::uint64_t revision) {
  return fmt::format("{} {} {}", table, uid, revision);
}

std::string place_of_reply(const std::string& client, std::uint64_t id) {
  return fmt::format("replies {} {}", id, client);
}

void add_seal(std::string& row, const std::string& place) {
  const std::string seal = seal_of({row, place});
  row.append(kMark).append(seal);
}

Seal take_seal(std::string& row, const std::string& place) {
  if (row.size() < kSealBytes) return Seal::kNone;
  const std::string_view whole = row;
  const std::string_view message = whole.substr(0, row.size() - kSealBytes);
  const std::string_view end = whole.substr(message.size());
  if (!end.starts_with(kMark)) return Seal::kNone;
  const bool is_right = end.substr(kMark.size()) == seal_of({message, place});
  row.resize(message.size());
  return is_right ? Seal::kRight : Seal::kWrong;
}

}  // namespace limber::server::store
