#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/scene/formats/abaqus_keyword.h"
#include "engine/scene/formats/mesh_builder.h"

namespace limber::scene::formats {

/// Element sets, isotropic elastic materials and solid sections of an Abaqus file: the material of
/// each tet. Other contents become warnings.
class AbaqusMaterials {
 public:
  /// A keyword line of a part (0: before any part). @returns whether its data lines are for data()
  bool begin(const AbaqusKeyword& keyword, std::int64_t part);
  void data(std::string_view line);
  /// The set that *ELEMENT puts an element into. @param set  empty: none
  void put(const std::string& set, std::int64_t part, std::int64_t label);

  /// Gives the tets that were added their materials and groups.
  /// @param part_stride  a tet's own label is the label in its part, and so often this as the part
  void store(MeshBuilder& builder, std::int64_t part_stride) const;

 private:
  enum class Data { kNone, kSet, kElastic, kDensity };
  using SetName = std::pair<std::int64_t, std::string>;  // part, name
  struct Set {
    std::vector<std::pair<std::int64_t, std::int64_t>> runs;  // first, last label
    std::vector<std::int64_t> steps;                          // of runs
    std::vector<std::string> others;                          // sets within it
  };
  struct Elastic {
    std::optional<double> youngs_modulus, poissons_ratio, density;
    int rows = 0;  // of *ELASTIC and *DENSITY beyond the first
  };
  struct Section {
    SetName set;
    std::string material;
  };

  void add_to_set(std::string_view line);
  void read_row(std::string_view line);
  [[nodiscard]] std::set<int> tets_of(const SetName& name,
                                      const std::map<std::int64_t, int>& tet_of,
                                      std::int64_t part_stride, std::int64_t& budget) const;
  void assign(const Section& section, const std::set<int>& tets, MeshBuilder& builder) const;

  Data data_ = Data::kNone;
  SetName open_set_;
  bool is_generated_ = false;
  std::string open_material_;
  bool is_first_row_ = false;
  std::map<SetName, Set> sets_;
  std::vector<SetName> set_order_;
  std::map<std::string, Elastic> materials_;
  std::vector<Section> sections_;
  std::set<std::string> unread_;  // keywords of materials
};

}  // namespace limber::scene::formats
