#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace limber::scene::formats {

enum class ByteOrder { kLittle, kBig };

/// A number from bytes of the given order, on machines of any order. `bytes` holds at least
/// sizeof(T).
template <typename T>
[[nodiscard]] T decode(const char* bytes, ByteOrder order) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  char raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (order == ByteOrder::kBig) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

}  // namespace limber::scene::formats
