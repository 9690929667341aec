#include "server/store/log_check.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>

namespace limber::server::store {
namespace {

constexpr std::size_t kHeaderBytes = 32, kFrameHeaderBytes = 24, kSummedOfFrameHeader = 8;
constexpr std::uint32_t kMagic = 0x377f0682;  // the last bit: words are summed as big-endian

/// The i-th number of a header.
std::uint32_t number(std::string_view header, std::size_t i) {
  std::uint32_t value = 0;
  for (std::size_t k = 4 * i; k < 4 * i + 4; ++k)
    value = value << 8 | static_cast<unsigned char>(header[k]);
  return value;
}

/// Checksum of all words of the log up to a place.
struct Sum {
  bool is_big_endian = false;
  std::uint32_t first = 0, second = 0;

  void add(std::string_view bytes) {
    const auto word = [&](std::size_t i) {
      const std::uint32_t value = number(bytes, i);
      return is_big_endian ? value : __builtin_bswap32(value);
    };
    for (std::size_t i = 0; 4 * i + 8 <= bytes.size(); i += 2) {
      first += word(i) + second;
      second += word(i + 1) + first;
    }
  }
  [[nodiscard]] bool is(std::uint32_t a, std::uint32_t b) const {
    return first == a && second == b;
  }
};

/// Page number, pages behind a transaction (0 within it), two salts, two sums; and the page.
struct Frame {
  std::string bytes;

  [[nodiscard]] bool ends_transaction() const { return number(bytes, 1) != 0; }
  /// A log is written from its beginning again and again: frames of earlier rounds have others.
  [[nodiscard]] bool has_salts(std::uint32_t a, std::uint32_t b) const {
    return number(bytes, 2) == a && number(bytes, 3) == b;
  }
  [[nodiscard]] bool continues(Sum& sum) const {
    const std::string_view all = bytes;
    sum.add(all.substr(0, kSummedOfFrameHeader));
    sum.add(all.substr(kFrameHeaderBytes));
    return sum.is(number(bytes, 4), number(bytes, 5));
  }
};

bool read(std::ifstream& file, std::string& bytes) {
  return static_cast<bool>(file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())));
}

}  // namespace

std::uint64_t lost_transactions(const std::filesystem::path& log, std::uint64_t page_bytes) {
  std::ifstream file(log, std::ios::binary);
  std::string header(kHeaderBytes, '\0');
  if (!read(file, header)) return 0;
  Sum sum{(number(header, 0) & 1) != 0};
  sum.add(std::string_view(header).substr(0, 24));
  const bool is_header_lost =
      (number(header, 0) | 1) != (kMagic | 1) || !sum.is(number(header, 6), number(header, 7));
  std::uint32_t salts[2] = {number(header, 4), number(header, 5)};
  bool is_sound = !is_header_lost, is_first = true;
  std::uint64_t lost = 0;
  for (Frame frame{std::string(kFrameHeaderBytes + page_bytes, '\0')}; read(file, frame.bytes);
       is_first = false) {
    if (is_header_lost && is_first) {
      salts[0] = number(frame.bytes, 2);
      salts[1] = number(frame.bytes, 3);
    }
    const bool has_salts = frame.has_salts(salts[0], salts[1]);
    const bool continues = is_sound && frame.continues(sum);
    is_sound = continues && has_salts;
    // The sums do not cover the salts: that it continues the log tells of salts that are damaged.
    if (!is_sound && (has_salts || continues) && frame.ends_transaction()) ++lost;
  }
  return is_header_lost ? std::max<std::uint64_t>(lost, 1) : lost;
}

}  // namespace limber::server::store
