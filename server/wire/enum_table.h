#pragma once

#include <array>
#include <initializer_list>
#include <string_view>

#include "engine/base/error.h"

namespace limber::server {

/// Whether an enumerator has this value: compilers write a value without one as a cast, "(Enum)3".
template <auto kValue>
[[nodiscard]] consteval bool is_enumerator() {
  constexpr std::string_view kBefore = "kValue = ";
  const std::string_view name = __PRETTY_FUNCTION__;
  return name[name.find(kBefore) + kBefore.size()] != '(';
}

/// For an enum whose values are 0, 1, ...
template <class Enum, int kFrom = 0>
[[nodiscard]] consteval int enumerator_count() {
  if constexpr (is_enumerator<static_cast<Enum>(kFrom)>())
    return enumerator_count<Enum, kFrom + 1>();
  else
    return kFrom;
}

/// The same values in the engine and on the wire. A table that leaves out a value of the engine, or
/// has one twice, does not compile.
/// @tparam kLast  Proto_MAX: every value of the wire up to it, but 0 (unspecified), has a row, too;
/// 0: the wire has more values, or the table is only encoded by
template <class Engine, class Proto, Proto kLast = Proto{}>
class EnumTable {
 public:
  struct Row {
    Engine engine;
    Proto proto;
  };

  consteval EnumTable(std::initializer_list<Row> rows) {
    if (rows.size() != rows_.size()) throw "each value of the engine needs one row";
    std::size_t count = 0;
    for (const Row& row : rows) {
      for (std::size_t i = 0; i < count; ++i)
        if (rows_[i].engine == row.engine) throw "a value of the engine has two rows";
      rows_[count++] = row;
    }
    for (int value = 1; value <= static_cast<int>(kLast); ++value) {
      bool found = false;
      for (const Row& row : rows_) found = found || static_cast<int>(row.proto) == value;
      if (!found) throw "a value of the wire has no row";
    }
  }

  [[nodiscard]] constexpr Proto encode(Engine value) const {
    for (const Row& row : rows_)
      if (row.engine == value) return row.proto;
    LIMBER_DEMAND(false);
    return Proto{};
  }
  /// @returns the engine's value of the first row for one without a row: the default
  [[nodiscard]] constexpr Engine decode(Proto value) const {
    for (const Row& row : rows_)
      if (row.proto == value) return row.engine;
    return rows_[0].engine;
  }

 private:
  std::array<Row, static_cast<std::size_t>(enumerator_count<Engine>())> rows_{};
};

}  // namespace limber::server
