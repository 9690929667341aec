#include "engine/scene/formats/material_files.h"

#include <algorithm>
#include <map>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/material_table.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene {
namespace {

using formats::TextCursor;

struct Group {
  bodies::Material material;
  std::int64_t announced = -1;  // *num_of_tets; -1: not stated
  std::vector<std::int64_t> tets;
  std::int64_t line = 0;
};

/// The part behind '=' of "NAME=GROUP_0".
std::string value_of(std::string_view word) {
  const std::size_t equals = word.find('=');
  return std::string(equals == std::string_view::npos ? "" : word.substr(equals + 1));
}

std::vector<Group> parse_groups(TextCursor& file) {
  file.set_comma_separates(true);
  std::vector<Group> groups;
  std::map<std::string, std::size_t> by_name;
  Group* set = nullptr;  // whose list is being read
  while (file.skip_blanks()) {
    if (file.peek() != '*') {
      if (set == nullptr) file.fail("expected a line that begins with '*'");
      set->tets.push_back(file.integer("a tet id"));
      continue;
    }
    const std::int64_t line = file.line();
    const std::string keyword = formats::to_lower(file.word());
    if (keyword == "*elset") {
      const std::string name = file.skip_blanks_in_line() ? value_of(file.word()) : "";
      const auto found = by_name.find(name);
      if (found == by_name.end())
        file.fail_at(line, "there is no material for the set " + formats::in_quotes(name));
      set = &groups[found->second];
      continue;
    }
    set = nullptr;
    if (keyword == "*groups") {
      file.integer_in_line("a number of groups");
    } else if (keyword == "*material") {
      const std::string name = file.skip_blanks_in_line() ? value_of(file.word()) : "";
      if (name.empty()) file.fail_at(line, "*MATERIAL without NAME=");
      if (!by_name.emplace(name, groups.size()).second) {
        file.fail_at(line, "the material " + formats::in_quotes(name) + " is given twice");
      }
      groups.emplace_back();
      groups.back().line = line;
    } else if (groups.empty()) {
      file.fail_at(line, "expected *MATERIAL, found " + formats::in_quotes(keyword));
    } else if (keyword == "*elastic") {
      groups.back().material.youngs_modulus = file.real("Young's modulus");
      groups.back().material.poissons_ratio = file.real("Poisson's ratio");
    } else if (keyword == "*density") {
      groups.back().material.density = file.real("a density");
    } else if (keyword == "*num_of_tets") {
      groups.back().announced = file.integer_in_line("a number of tets");
    } else {
      file.fail_at(line, "the keyword " + formats::in_quotes(keyword) + " is not known");
    }
  }
  if (groups.empty()) file.fail("the file has no materials");
  return groups;
}

/// Checks the lists and finds their first id.
std::int64_t first_id(const std::vector<Group>& groups, std::int64_t tet_count,
                      const TextCursor& file) {
  std::int64_t smallest = 1;
  std::int64_t largest = 0;
  for (const Group& group : groups) {
    if (group.announced >= 0 && group.announced != static_cast<std::int64_t>(group.tets.size())) {
      file.fail_at(group.line, "the group announces " + std::to_string(group.announced) +
                                   " tets, its list has " + std::to_string(group.tets.size()));
    }
    for (const std::int64_t tet : group.tets) {
      if (tet < 0 || tet > tet_count) {
        file.fail_at(group.line, "tet id " + std::to_string(tet) + " of a mesh of " +
                                     std::to_string(tet_count) + " tets");
      }
      smallest = std::min(smallest, tet);
      largest = std::max(largest, tet);
    }
  }
  if (smallest == 0 && largest == tet_count) {
    file.fail("tet ids run from 0 to " + std::to_string(tet_count) + " for a mesh of " +
              std::to_string(tet_count) + " tets");
  }
  return largest == tet_count ? 1 : 0;
}

}  // namespace

void read_materials(const std::string& name, std::string_view content, MeshReading& reading) {
  TextCursor file(name, content);
  const std::vector<Group> groups = parse_groups(file);
  const std::int64_t base = first_id(groups, reading.mesh.tet_count(), file);
  formats::MaterialTable table(static_cast<std::size_t>(reading.mesh.tet_count()));
  int for_the_rest = -1;
  for (const Group& group : groups) {
    const int material = table.add_material(group.material);
    if (group.tets.empty()) {
      if (for_the_rest >= 0) file.fail_at(group.line, "a second group without tets");
      for_the_rest = material;
    }
    for (const std::int64_t id : group.tets) {
      const auto tet = to_whole<int>(id - base);  // first_id() has checked its range
      if (!tet || table.assigned(*tet))
        file.fail_at(group.line, "tet id " + std::to_string(id) + " has a material already");
      table.assign(*tet, material);
    }
  }
  if (for_the_rest >= 0) table.assign_unassigned(for_the_rest);
  table.store(reading);
}

std::vector<int> read_fixed_nodes(const std::string& name, std::string_view content,
                                  int node_count) {
  TextCursor file(name, content);
  file.set_comma_separates(true);
  const std::int64_t count = file.count("the number of fixed nodes", 2);
  std::vector<int> nodes;
  nodes.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    const std::int64_t given = file.integer("a node id");
    const auto node = to_whole<int>(given);
    if (!node || *node < 0 || *node >= node_count) {
      file.fail("node id " + std::to_string(given) + " of a mesh of " + std::to_string(node_count) +
                " nodes");
    }
    nodes.push_back(*node);
  }
  if (file.skip_blanks()) file.fail("there are more node ids than the count says");
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

}  // namespace limber::scene
