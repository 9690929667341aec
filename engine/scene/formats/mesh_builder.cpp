#include "engine/scene/formats/mesh_builder.h"

#include <algorithm>
#include <cmath>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/material_table.h"

namespace limber::scene::formats {

std::int64_t LabelMap::seal() {
  consecutive_ = true;
  for (std::size_t i = 1; i < labels_.size() && consecutive_; ++i) {
    consecutive_ = labels_[i - 1] < INT64_MAX && labels_[i] == labels_[i - 1] + 1;
  }
  if (consecutive_) return -1;
  by_label_.reserve(labels_.size());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    by_label_.emplace_back(labels_[i], static_cast<int>(i));
  }
  std::sort(by_label_.begin(), by_label_.end());
  for (std::size_t i = 1; i < by_label_.size(); ++i) {
    if (by_label_[i].first == by_label_[i - 1].first) return by_label_[i].second;
  }
  return -1;
}

int LabelMap::find(std::int64_t label) const {
  if (labels_.empty()) return -1;
  if (consecutive_) {
    if (label < labels_.front() || label > labels_.back()) return -1;
    return to_whole<int>(label - labels_.front()).value_or(-1);
  }
  const auto found = std::lower_bound(by_label_.begin(), by_label_.end(), std::pair(label, -1));
  return found != by_label_.end() && found->first == label ? found->second : -1;
}

void MeshBuilder::reserve_nodes(std::int64_t count) {
  // With many small parts, each would be copied together with those before it.
  const std::size_t needed = nodes_.size() + static_cast<std::size_t>(count);
  if (needed <= nodes_.capacity()) return;
  const std::size_t reserved = std::max(needed, 2 * nodes_.capacity());
  nodes_.reserve(reserved);
  labels_.reserve(reserved);
}

void MeshBuilder::add_node(std::int64_t label, double x, double y, double z) {
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
    file_.fail("a coordinate of node " + std::to_string(label) + " is not finite");
  }
  labels_.add(label);
  nodes_.push_back({x, y, z});
}

void MeshBuilder::add_tet(std::int64_t label, const std::array<std::int64_t, 4>& node_labels,
                          std::int64_t line, std::int64_t group) {
  tets_.push_back({label, node_labels, line, group});
}

void MeshBuilder::set_material(std::size_t tet, const bodies::Material& material) {
  try {
    material.validate("");
  } catch (const Error&) {
    ++refused_materials_;
    return;
  }
  const std::array<double, 3> numbers = {material.youngs_modulus, material.poissons_ratio,
                                         material.density};
  const auto [found, is_new] =
      material_numbers_.try_emplace(numbers, static_cast<int>(materials_.size()));
  if (is_new) materials_.push_back(material);
  if (tet_material_.size() <= tet) tet_material_.resize(tet + 1, -1);
  tet_material_[tet] = found->second;
}

void MeshBuilder::store_groups(MeshReading& reading) const {
  std::map<std::int64_t, MeshGroup> by_number;
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    if (tets_[t].group != kNoGroup) by_number[tets_[t].group].tets.push_back(static_cast<int>(t));
  }
  const bool is_whole =
      by_number.size() == 1 && by_number.begin()->second.tets.size() == tets_.size();
  for (auto& [number, group] : by_number) {
    const auto name = names_.find(number);
    if (is_whole && name == names_.end()) continue;
    group.name = name == names_.end() ? std::to_string(number) : name->second;
    reading.groups.push_back(std::move(group));
  }
  reading.groups.insert(reading.groups.end(), groups_.begin(), groups_.end());
}

void MeshBuilder::store_materials(MeshReading& reading) const {
  if (refused_materials_ > 0) {
    reading.warnings.push_back(std::to_string(refused_materials_) +
                               " tetrahedra have a material in the file that is none (E > 0, -1 < "
                               "nu < 0.5 and density > 0 "
                               "are needed); it is not taken");
  }
  if (materials_.empty()) return;
  MaterialTable table(tets_.size());
  for (const bodies::Material& material : materials_) table.add_material(material);
  for (std::size_t t = 0; t < tet_material_.size(); ++t) {
    if (tet_material_[t] >= 0) table.assign(static_cast<int>(t), tet_material_[t]);
  }
  table.store(reading);
}

void MeshBuilder::ignore_cell(const std::string& kind, std::int64_t count) {
  constexpr std::size_t kKinds = 20, kBytesOfName = 40;
  const std::string name = kind.substr(0, kBytesOfName);
  const bool is_listed = ignored_.size() < kKinds || ignored_.contains(name);
  ignored_[is_listed ? name : "of other kinds"] += count;
}

void MeshBuilder::warn(std::string message) {
  constexpr std::size_t kWarnings = 50;
  if (warnings_.size() < kWarnings) {
    warnings_.push_back(std::move(message));
  } else {
    ++further_warnings_;
  }
}

MeshReading MeshBuilder::finish() {
  if (nodes_.empty()) file_.fail("the file has no nodes");
  if (tets_.empty()) {
    std::string others;
    for (const auto& [kind, count] : ignored_) {
      if (count == 0) continue;  // an empty section
      others += (others.empty() ? " (but " : ", ") + std::to_string(count) + " " + kind;
    }
    file_.fail("the file has no tetrahedra" + others + (others.empty() ? "" : ")"));
  }
  if (const std::int64_t twice = labels_.seal(); twice >= 0) {
    file_.fail("node id " + std::to_string(labels_.label(static_cast<std::size_t>(twice))) +
               " is given twice");
  }
  MeshReading result;
  result.mesh.nodes.resize(3, static_cast<Eigen::Index>(nodes_.size()));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    result.mesh.nodes.col(static_cast<Eigen::Index>(i)) << nodes_[i][0], nodes_[i][1], nodes_[i][2];
  }
  result.mesh.tets.resize(4, static_cast<Eigen::Index>(tets_.size()));
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    for (int corner = 0; corner < 4; ++corner) {
      const std::int64_t label = tets_[t].nodes[static_cast<std::size_t>(corner)];
      const int node = labels_.find(label);
      if (node < 0) {
        file_.fail_at(tets_[t].line, "tetrahedron " + std::to_string(t) +
                                         " (from 0) uses node id " + std::to_string(label) +
                                         ", which the file does not define");
      }
      result.mesh.tets(corner, static_cast<Eigen::Index>(t)) = node;
    }
  }
  for (const auto& [kind, count] : ignored_) {
    if (count == 0) continue;  // an empty section
    warnings_.push_back(std::to_string(count) + " cells that are no tetrahedra are ignored (" +
                        kind + ")");
  }
  if (curved_tets_ > 0) {
    warnings_.push_back(std::to_string(curved_tets_) +
                        " tetrahedra of higher order are read by their corners");
  }
  if (further_warnings_ > 0)
    warnings_.push_back("there are " + std::to_string(further_warnings_) + " further warnings");
  result.warnings = std::move(warnings_);
  store_groups(result);
  store_materials(result);
  return result;
}

}  // namespace limber::scene::formats
