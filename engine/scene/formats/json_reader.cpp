#include "engine/scene/formats/json_reader.h"

#include <nlohmann/json.hpp>

namespace limber::scene::formats {

Json parse_object(std::string_view text, const std::function<void(const std::string&)>& refuse) {
  // Files have a few levels; deeper ones would overflow the stack of a recursive visitor.
  constexpr int kMaxLevels = 100;
  const auto check_depth = [&](int depth, Json::parse_event_t, const Json&) {
    if (depth > kMaxLevels)
      refuse("is nested deeper than " + std::to_string(kMaxLevels) + " levels");
    return true;
  };
  Json document = Json::parse(text, check_depth, false);
  if (document.is_discarded()) refuse("is not JSON");
  if (!document.is_object()) refuse("is not a JSON object");
  return document;
}

}  // namespace limber::scene::formats
