#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace limber::server::store {

/// A row's message with a seal behind it: field 60, twelve bytes, of which the last eight are the
/// first of the ContentHash of the bytes before. Servers that know no seals pass over it as a field
/// that they do not know.
///
/// @param beside  what else of the row it is of
[[nodiscard]] std::string sealed(std::string_view message,
                                 std::initializer_list<std::string_view> beside = {});

struct Unsealed {
  std::string message;
  /// The row is not what was written. False without a seal: it is of an earlier server.
  bool is_damaged = false;
};
/// @param beside  as given to sealed()
[[nodiscard]] Unsealed unsealed(std::string row,
                                std::initializer_list<std::string_view> beside = {});

}  // namespace limber::server::store
