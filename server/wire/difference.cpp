#include "server/wire/difference.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::size_t kBlock = 16;  // bytes by which moved parts are found

void add_varint(std::uint64_t number, std::string& to) {
  for (; number >= 0x80; number >>= 7u) to.push_back(static_cast<char>(number | 0x80u));
  to.push_back(static_cast<char>(number));
}

std::uint64_t take_varint(std::string_view& from) {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64 && !from.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(from.front());
    from.remove_prefix(1);
    number |= std::uint64_t{byte & 0x7fu} << shift;
    if (byte < 0x80) return number;
  }
  throw malformed("a difference of bytes ends within a number");
}

void add_piece(std::size_t from, std::size_t count, std::string_view added, std::string& to) {
  if (count == 0 && added.empty()) return;
  add_varint(count, to);
  add_varint(from, to);
  add_varint(added.size(), to);
  to.append(added);
}

std::size_t common_beginning(std::string_view a, std::string_view b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return static_cast<std::size_t>(end - a.begin());
}

/// Positions of blocks of bytes: one every kBlock bytes; if blocks are equal, the last.
class Blocks {
 public:
  explicit Blocks(std::string_view bytes) : bytes_(bytes) {
    const std::size_t count = bytes.size() / kBlock;
    if (count == 0) return;
    places_.assign(std::bit_ceil(2 * count), 0);
    for (std::size_t i = 0; i < count; ++i)
      places_[slot(bytes.substr(i * kBlock, kBlock))] = static_cast<std::uint32_t>(i + 1);
  }
  /// @returns the place of bytes that are those, or npos
  [[nodiscard]] std::size_t find(std::string_view block) const {
    if (places_.empty() || block.size() < kBlock) return std::string_view::npos;
    const std::uint32_t place = places_[slot(block)];
    if (place == 0) return std::string_view::npos;
    const std::size_t at = (place - 1) * kBlock;
    return bytes_.substr(at, kBlock) == block.substr(0, kBlock) ? at : std::string_view::npos;
  }

 private:
  [[nodiscard]] std::size_t slot(std::string_view block) const {
    std::uint64_t low = 0, high = 0;
    std::memcpy(&low, block.data(), 8);
    std::memcpy(&high, block.data() + 8, 8);
    std::uint64_t hash = (low ^ std::rotl(high, 29)) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32u;
    return hash & (places_.size() - 1);
  }

  std::string_view bytes_;
  std::vector<std::uint32_t> places_;  // number of the block + 1; 0: none
};

}  // namespace

std::string difference_of(std::string_view before, std::string_view after) {
  std::string difference;
  // Equal parts at both ends need no search.
  const std::size_t head = common_beginning(before, after);
  const std::size_t rest = std::min(before.size(), after.size()) - head;
  std::size_t tail = 0;
  while (tail < rest && before[before.size() - 1 - tail] == after[after.size() - 1 - tail]) ++tail;
  const std::string_view old = before.substr(0, before.size() - tail);
  const std::size_t end = after.size() - tail;
  const Blocks blocks(end - head >= kBlock ? old.substr(head) : std::string_view());
  std::size_t from = 0, count = head;  // the open piece
  std::size_t added = head;            // where its new bytes begin
  for (std::size_t i = head; i < end;) {
    std::size_t found = blocks.find(after.substr(i, end - i));
    if (found == std::string_view::npos) {
      ++i;
      continue;
    }
    found += head;
    std::size_t begin = i;
    while (begin > added && found > 0 && after[begin - 1] == old[found - 1]) --begin, --found;
    add_piece(from, count, after.substr(added, begin - added), difference);
    from = found;
    count = common_beginning(old.substr(found), after.substr(begin, end - begin));
    i = added = begin + count;
  }
  add_piece(from, count, after.substr(added, end - added), difference);
  add_piece(before.size() - tail, tail, {}, difference);
  return difference;
}

std::string with_difference(std::string_view before, std::string_view difference,
                            std::size_t most) {
  std::string after;
  while (!difference.empty()) {
    const std::uint64_t count = take_varint(difference);
    const std::uint64_t from = take_varint(difference);
    const std::uint64_t added = take_varint(difference);
    if (from > before.size() || count > before.size() - from)
      throw malformed("a difference takes bytes that are not there");
    if (added > difference.size()) throw malformed("a difference of bytes is cut short");
    if (count + added > most - after.size())
      throw malformed("a difference leads to too many bytes");
    after.append(before.substr(from, count));
    after.append(difference.substr(0, added));
    difference.remove_prefix(added);
  }
  return after;
}

}  // namespace limber::server
