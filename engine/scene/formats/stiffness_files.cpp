#include "engine/scene/formats/stiffness_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/json_reader.h"
#include "engine/scene/formats/ply_file.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene {
namespace {

using formats::Json;
using formats::TextCursor;

std::vector<double> values_of_text(TextCursor& file) {
  file.set_comment('#');
  file.set_comma_separates(true);
  std::vector<double> numbers;
  while (file.skip_blanks()) numbers.push_back(file.real("a number for a point"));
  return numbers;
}

bool is_stiffness(const formats::PlyProperty& property) {
  static constexpr std::array<std::string_view, 3> kNames = {"stiffness", "quality", "value"};
  return !property.list && (property.name.starts_with("scalar_") ||
                            std::find(kNames.begin(), kNames.end(), property.name) != kNames.end());
}

std::vector<double> values_of_ply(TextCursor& file) {
  formats::PlyFile ply(file);
  for (const formats::PlyElement& element : ply.elements()) {
    ply.check_count(element);
    const auto& properties = element.properties;
    const auto wanted = std::find_if(properties.begin(), properties.end(), is_stiffness);
    const bool is_vertex = element.name == "vertex";
    if (is_vertex && wanted == properties.end())
      file.fail("vertices have no property stiffness, quality, value or scalar_...");
    std::vector<double> numbers;
    for (std::int64_t i = 0; i < element.count; ++i) {
      for (auto property = properties.begin(); property != properties.end(); ++property) {
        const std::vector<double>& values = ply.read(*property);
        if (is_vertex && property == wanted) numbers.push_back(values[0]);
      }
    }
    if (is_vertex) return numbers;
  }
  file.fail("the file has no vertices");
}

/// @throws Error through `file`; of a group that is none
PaintedStiffness stiffness_of(const Json& group, const std::string& name, const TextCursor& file) {
  std::optional<PaintedStiffness> found;
  for (const auto& [key, value] : group.items()) {
    if (key == "vertices") continue;
    const bool is_factor = key == "factor";
    if (!is_factor && key != "youngs_modulus")
      file.fail("group " + name + " has the key " + formats::in_quotes(key) +
                ": vertices and either factor or youngs_modulus are expected");
    if (found || !value.is_number())
      file.fail("group " + name + " needs one number: factor or youngs_modulus");
    found = {value.get<double>(),
             is_factor ? StiffnessQuantity::kFactor : StiffnessQuantity::kYoungsModulus};
  }
  if (!found) file.fail("group " + name + " has neither factor nor youngs_modulus");
  return *found;
}

std::vector<PaintedStiffness> values_of_groups(const TextCursor& file, std::string_view content,
                                               int point_count) {
  const Json document =
      formats::parse_object(content, [&](const std::string& why) { file.fail("the file " + why); });
  const auto groups = document.find("groups");
  if (groups == document.end() || !groups->is_object()) file.fail("the file has no object groups");
  std::vector<PaintedStiffness> painted(static_cast<std::size_t>(std::max(point_count, 0)));
  std::vector<char> is_taken(painted.size(), 0);
  for (const auto& [key, group] : groups->items()) {
    const std::string name = formats::in_quotes(key);
    if (!group.is_object()) file.fail("group " + name + " is no object");
    const PaintedStiffness stiffness = stiffness_of(group, name, file);
    const auto vertices = group.find("vertices");
    if (vertices == group.end() || !vertices->is_array())
      file.fail("group " + name + " has no list of vertices");
    for (const Json& vertex : *vertices) {
      const auto* const given = vertex.get_ptr<const Json::number_unsigned_t*>();
      const auto at = given == nullptr ? std::nullopt : to_whole<std::size_t>(*given);
      if (!at || *at >= painted.size()) {
        file.fail("group " + name + " has a vertex that is none of " +
                  std::to_string(painted.size()));
      }
      if (is_taken[*at] != 0)
        file.fail("group " + name + " has vertex " + std::to_string(*at) +
                  ", which is in a group before");
      is_taken[*at] = 1;
      painted[*at] = stiffness;
    }
  }
  return painted;
}

}  // namespace

std::vector<PaintedStiffness> read_stiffness(const std::string& name, std::string_view content,
                                             StiffnessQuantity quantity, int point_count) {
  if (content.substr(0, 3) == "\xEF\xBB\xBF") content.remove_prefix(3);  // byte order mark
  TextCursor file(name, content);
  if (formats::trim(content).starts_with("{")) return values_of_groups(file, content, point_count);
  const std::vector<double> numbers = content.starts_with("ply\n") || content.starts_with("ply\r\n")
                                          ? values_of_ply(file)
                                          : values_of_text(file);
  if (!std::in_range<int>(numbers.size()) || static_cast<int>(numbers.size()) != point_count) {
    file.fail(std::to_string(numbers.size()) + " numbers are given for " +
              std::to_string(point_count) + " points");
  }
  std::vector<PaintedStiffness> painted;
  painted.reserve(numbers.size());
  for (const double number : numbers) painted.push_back({number, quantity});
  return painted;
}

}  // namespace limber::scene
