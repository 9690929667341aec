#include "engine/scene/formats/base64.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace limber::scene::formats {
namespace {

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::int8_t kBlank = -1;
constexpr std::int8_t kPadding = -2;
constexpr std::int8_t kInvalid = -3;

constexpr std::array<std::int8_t, 256> make_table() {
  std::array<std::int8_t, 256> table{};
  for (auto& entry : table) entry = kInvalid;
  for (std::size_t i = 0; i < kAlphabet.size(); ++i) {
    table[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::int8_t>(i);
  }
  for (const char c : {' ', '\t', '\r', '\n'}) table[static_cast<unsigned char>(c)] = kBlank;
  table['='] = kPadding;
  return table;
}

}  // namespace

std::optional<std::string> decode_base64(std::string_view text, std::size_t max_bytes) {
  static constexpr std::array<std::int8_t, 256> kTable = make_table();
  std::string result;
  result.reserve(std::min(max_bytes, text.size() / 4 * 3 + 3));
  std::uint32_t quad = 0;
  int digits = 0;  // of this group of four, padding included
  int padding = 0;
  for (const char c : text) {
    if (result.size() >= max_bytes) break;
    const std::int8_t value = kTable[static_cast<unsigned char>(c)];
    if (value == kBlank) continue;
    if (value == kInvalid) return std::nullopt;
    if (value == kPadding) {
      if (digits < 2) return std::nullopt;
      ++padding;
      quad <<= 6;
    } else {
      if (padding > 0) return std::nullopt;
      quad = quad << 6 | static_cast<std::uint32_t>(value);
    }
    if (++digits == 4) {
      for (int byte = 0; byte < 3 - padding; ++byte) {
        result += static_cast<char>(quad >> (16 - 8 * byte) & 0xff);
      }
      quad = 0;
      digits = 0;
      padding = 0;
    }
  }
  if (digits != 0 && result.size() < max_bytes) return std::nullopt;
  if (result.size() > max_bytes) result.resize(max_bytes);
  return result;
}

std::string encode_base64(std::string_view bytes) {
  std::string result;
  result.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t size = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t triple = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      triple = triple << 8 | (j < size ? static_cast<unsigned char>(bytes[i + j]) : 0u);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      result += j <= size ? kAlphabet[triple >> (18 - 6 * j) & 63] : '=';
    }
  }
  return result;
}

}  // namespace limber::scene::formats
