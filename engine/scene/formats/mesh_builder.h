#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

/// Turns the labels of a file (any integers) into columns counted from 0 in the order of the file.
class LabelMap {
 public:
  void reserve(std::size_t count) { labels_.reserve(count); }
  void add(std::int64_t label) { labels_.push_back(label); }
  [[nodiscard]] std::size_t size() const { return labels_.size(); }
  /// To be called once all labels are known. @returns the position of a label that is given twice,
  /// or -1.
  std::int64_t seal();
  /// @returns the position of the label, or -1.
  [[nodiscard]] int find(std::int64_t label) const;
  [[nodiscard]] std::int64_t label(std::size_t position) const { return labels_[position]; }

 private:
  std::vector<std::int64_t> labels_;
  bool consecutive_ = false;  // label = first + position: no search needed
  std::vector<std::pair<std::int64_t, int>> by_label_;  // sorted, where they are not
};

/// Collects the data of a reader and makes the mesh: ids are resolved, cells other than tets are
/// counted, no value is guessed.
class MeshBuilder {
 public:
  /// Memory of each, here and in the resulting mesh; lists that grow take twice as much.
  static constexpr std::size_t kBytesOfNode = 96, kBytesOfTet = 160;
  static constexpr std::int64_t kNoGroup = INT64_MIN;

  explicit MeshBuilder(const TextCursor& file) : file_(file) {}

  void reserve_nodes(std::int64_t count);
  void reserve_tets(std::int64_t count) { tets_.reserve(static_cast<std::size_t>(count)); }
  void add_node(std::int64_t label, double x, double y, double z);
  /// @param label  of the element, for material sets; -1 where the format has none
  /// @param group  number of the group that the file puts it into
  void add_tet(std::int64_t label, const std::array<std::int64_t, 4>& node_labels,
               std::int64_t line, std::int64_t group = kNoGroup);
  void name_group(std::int64_t group, std::string name) { names_[group] = std::move(name); }
  /// A group that is no number of tets, e.g. an element set.
  void add_group(MeshGroup group) { groups_.push_back(std::move(group)); }
  /// Sets the material of an added tet. Invalid materials (see bodies::Material::validate) are
  /// counted.
  void set_material(std::size_t tet, const bodies::Material& material);
  /// A tet of higher order, of which the corners were taken.
  void count_curved_tet() { ++curved_tets_; }
  /// A cell that is no tet, e.g. "triangle". A file may name any number of kinds, of any length:
  /// those beyond the first 20 are counted together, and names are cut.
  void ignore_cell(const std::string& kind, std::int64_t count = 1);
  /// Warnings after the first 50 are only counted.
  void warn(std::string message);

  [[nodiscard]] std::size_t node_count() const { return nodes_.size(); }
  [[nodiscard]] std::size_t tet_count() const { return tets_.size(); }
  [[nodiscard]] std::int64_t tet_label(std::size_t tet) const { return tets_[tet].label; }

  /// @throws Error for no nodes, no tets, a node label given twice or an id that no node has.
  [[nodiscard]] MeshReading finish();

 private:
  struct LabelledTet {
    std::int64_t label;
    std::array<std::int64_t, 4> nodes;
    std::int64_t line;
    std::int64_t group;
  };
  void store_groups(MeshReading& reading) const;
  void store_materials(MeshReading& reading) const;

  const TextCursor& file_;
  std::vector<std::array<double, 3>> nodes_;
  LabelMap labels_;
  std::vector<LabelledTet> tets_;
  std::map<std::int64_t, std::string> names_;  // of groups
  std::vector<MeshGroup> groups_;
  std::map<std::array<double, 3>, int> material_numbers_;
  std::vector<bodies::Material> materials_;
  std::vector<int> tet_material_;  // as far as they are known; -1: none
  std::int64_t refused_materials_ = 0;
  std::map<std::string, std::int64_t> ignored_;
  std::int64_t curved_tets_ = 0;
  std::vector<std::string> warnings_;
  std::int64_t further_warnings_ = 0;
};

}  // namespace limber::scene::formats
