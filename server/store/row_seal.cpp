#include "server/store/row_seal.h"

#include <cstdint>

#include "engine/base/hash.h"

namespace limber::server::store {
namespace {

using namespace std::string_view_literals;

/// Tag of field 60 as bytes, their count, and the name of the hash: a row that has no seal does not
/// end so by chance.
constexpr std::string_view kMark = "\xe2\x03\x0cxxh3"sv;
constexpr std::size_t kHashBytes = 8, kSealBytes = kMark.size() + kHashBytes;

std::string seal_of(std::string_view message, std::initializer_list<std::string_view> beside) {
  ContentHash hash;
  hash.add(message);
  for (const std::string_view one : beside) hash.add(one);
  const auto digest = hash.digest();
  return std::string(kMark).append(digest.begin(), digest.begin() + kHashBytes);
}

}  // namespace

std::string sealed(std::string_view message, std::initializer_list<std::string_view> beside) {
  const std::string seal = seal_of(message, beside);
  std::string row;
  row.reserve(message.size() + seal.size());
  return row.append(message).append(seal);
}

Unsealed unsealed(std::string row, std::initializer_list<std::string_view> beside) {
  if (row.size() < kSealBytes) return {std::move(row)};
  const std::size_t end = row.size() - kSealBytes;
  const std::string_view seal = std::string_view(row).substr(end);
  if (!seal.starts_with(kMark)) return {std::move(row)};
  const bool is_damaged = seal != seal_of(std::string_view(row).substr(0, end), beside);
  row.resize(end);
  return {std::move(row), is_damaged};
}

}  // namespace limber::server::store
