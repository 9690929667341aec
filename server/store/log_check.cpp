#include "server/store/log_check.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <span>

namespace limber::server::store {
namespace {

using Words = std::array<std::uint32_t, 8>;
constexpr std::uint64_t kHeaderBytes = 32, kFrameHeaderBytes = 24;
constexpr std::uint32_t kMagic = 0x377f0682;  // the last bit: words are summed as big-endian

std::uint32_t big_endian(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
         std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
}

/// @returns whether there was as much; numbers are big-endian
bool read(std::ifstream& file, std::uint64_t at, std::span<std::uint32_t> words) {
  std::array<unsigned char, kHeaderBytes> bytes{};
  file.seekg(static_cast<std::streamoff>(at));
  if (!file.read(reinterpret_cast<char*>(bytes.data()),
                 static_cast<std::streamsize>(4 * words.size())))
    return false;
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = big_endian(&bytes[4 * i]);
  return true;
}

bool is_sound(const Words& header) {
  const bool is_big_endian = (header[0] & 1) != 0;
  const auto word = [&](int i) {
    const std::uint32_t value = header[static_cast<std::size_t>(i)];
    return is_big_endian ? value : __builtin_bswap32(value);
  };
  std::uint32_t first = 0, second = 0;
  for (int i = 0; i < 6; i += 2) {
    first += word(i) + second;
    second += word(i + 1) + first;
  }
  return (header[0] | 1) == (kMagic | 1) && first == header[6] && second == header[7];
}

}  // namespace

std::uint64_t lost_transactions(const std::filesystem::path& log, std::uint64_t frames,
                                std::uint64_t page_bytes) {
  std::ifstream file(log, std::ios::binary);
  Words header{};
  if (!read(file, 0, header)) return 0;
  // Of page number, pages behind a transaction (0 within it), two salts, two sums.
  std::array<std::uint32_t, 6> frame{};
  const std::uint64_t stride = kFrameHeaderBytes + page_bytes;
  std::uint32_t salts[2] = {header[4], header[5]};
  const bool is_header_lost = !is_sound(header);  // SQLite has read nothing then
  if (is_header_lost) {
    if (!read(file, kHeaderBytes, frame)) return 0;
    salts[0] = frame[2];
    salts[1] = frame[3];
  }
  file.seekg(0, std::ios::end);
  const auto length = static_cast<std::uint64_t>(file.tellg());
  std::uint64_t lost = 0;
  // Those of an earlier round of the log, which is written from its beginning again and again,
  // have other salts.
  for (std::uint64_t i = frames; kHeaderBytes + (i + 1) * stride <= length; ++i) {
    if (!read(file, kHeaderBytes + i * stride, frame)) break;
    if (frame[2] == salts[0] && frame[3] == salts[1] && frame[1] != 0) ++lost;
  }
  return is_header_lost ? std::max<std::uint64_t>(lost, 1) : lost;
}

}  // namespace limber::server::store
