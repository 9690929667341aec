#pragma once

#include <fmt/format.h>

#include <exception>
#include <string>
#include <vector>

namespace limber::server {

/// Appends the entries of a list to `values`.
/// @param field  of the list
/// @param decode  an entry and its field; called again for one that is refused: fields of sound
/// entries, of which there may be thousands, are never written
template <class Messages, class Value, class Decode>
void decode_entries(const Messages& messages, const std::string& field, const Decode& decode,
                    std::vector<Value>& values) {
  static const std::string no_field;
  values.reserve(values.size() + static_cast<std::size_t>(messages.size()));
  for (int i = 0; i < messages.size(); ++i) {
    try {
      values.push_back(decode(messages.Get(i), no_field));
    } catch (const std::exception&) {
      (void)decode(messages.Get(i), fmt::format("{}[{}]", field, i));
      throw;
    }
  }
}

}  // namespace limber::server
