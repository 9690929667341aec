#pragma once

#include <map>
#include <string>
#include <string_view>

#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

/// A keyword line "*ELEMENT, TYPE=C3D4, ELSET=ALL" taken apart; everything in lower case.
struct AbaqusKeyword {
  std::string name;
  std::map<std::string, std::string> parameters;

  /// The value of a parameter, without the quotes that may be around it; empty: not given.
  [[nodiscard]] std::string value(const std::string& parameter) const {
    const auto found = parameters.find(parameter);
    if (found == parameters.end()) return {};
    std::string_view text = found->second;
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"')
      text = text.substr(1, text.size() - 2);
    return std::string(text);
  }
};

[[nodiscard]] inline AbaqusKeyword parse_abaqus_keyword(std::string_view line) {
  AbaqusKeyword result;
  bool first = true;
  line.remove_prefix(1);
  while (!line.empty()) {
    const std::size_t comma = line.find(',');
    const std::string_view part = trim(line.substr(0, comma));
    if (first) {
      result.name = to_lower(part);
      first = false;
    } else {
      const std::size_t equals = part.find('=');
      const std::string_view value =
          equals == std::string_view::npos ? "" : trim(part.substr(equals + 1));
      result.parameters[to_lower(trim(part.substr(0, equals)))] = to_lower(value);
    }
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  return result;
}

}  // namespace limber::scene::formats
