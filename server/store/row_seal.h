#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace limber::server::store {

/// Appends a seal to a serialised message: field 1000, twelve bytes, of which the last eight are
/// those of seal_of(). No message that is stored has a field of this number, so servers that know
/// no seals pass over it.
void add_seal(std::string& row);

enum class Seal {
  kNone,   // a row of an earlier server, or one that has lost its end
  kRight,  // the row is as it was written
  kWrong,
};
/// Takes the seal off.
[[nodiscard]] Seal take_seal(std::string& row);

/// The first eight bytes of the ContentHash of these values.
[[nodiscard]] std::string seal_of(std::initializer_list<std::string_view> values);

}  // namespace limber::server::store
