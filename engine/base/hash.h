#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

namespace limber {

/// 128-bit hash of content (XXH3), for cache keys and "same hash, same data". Not cryptographic.
///
/// Every value is framed with its length, so that ("ab", "c") and ("a", "bc") differ. Doubles are
/// hashed by their bits. The digest is the same on every little-endian machine.
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(ContentHash&&) noexcept;
  ContentHash& operator=(ContentHash&&) noexcept;

  ContentHash& add(std::string_view text) { return add_bytes(text.data(), text.size()); }
  ContentHash& add(const char* text) { return add(std::string_view(text)); }

  template <class Number,
            std::enable_if_t<std::is_arithmetic_v<Number> || std::is_enum_v<Number>, int> = 0>
  ContentHash& add(Number value) {
    return add_bytes(&value, sizeof value);
  }

  template <class Number>
  ContentHash& add_array(const Number* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<Number>, "no padding may be hashed");
    return add_bytes(values, count * sizeof(Number));
  }

  /// Shape and coefficients in storage order.
  template <class Derived>
  ContentHash& add(const Eigen::PlainObjectBase<Derived>& matrix) {
    add(static_cast<std::int64_t>(matrix.rows())).add(static_cast<std::int64_t>(matrix.cols()));
    return add_array(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }

  /// Digest of all added so far; more may be added afterwards.
  [[nodiscard]] std::array<std::uint8_t, 16> digest() const;
  /// The digest as 32 lower-case hexadecimal digits.
  [[nodiscard]] std::string hex() const;

 private:
  ContentHash& add_bytes(const void* data, std::size_t size);
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace limber
