#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

namespace limber::server::store {

/// Appends a seal to a serialised message: field 1000, twelve bytes, of which the last eight are
/// seal_of() the message and its place. No message that is stored has a field of this number, so
/// servers that know no seals pass over it.
/// @param place  table and key of the row, which another row's message does not fit
void add_seal(std::string& row, const std::string& place);

enum class Seal {
  kNone,   // a row of an earlier server, or one that has lost its end
  kRight,  // the row is as it was written
  kWrong,
};
/// Takes the seal off.
[[nodiscard]] Seal take_seal(std::string& row, const std::string& place);

/// For a row of a session, or an edit or checkpoint of it.
[[nodiscard]] std::string place_of(const char* table, std::uint64_t uid,
                                   std::uint64_t revision = 0);
/// For the reply to a request.
[[nodiscard]] std::string place_of_reply(const std::string& client, std::uint64_t id);

/// The first eight bytes of the ContentHash of these values.
[[nodiscard]] std::string seal_of(std::initializer_list<std::string_view> values);

}  // namespace limber::server::store
