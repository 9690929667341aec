#include "engine/scene/formats/abaqus_materials.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/checked_number.h"

namespace limber::scene::formats {
namespace {

/// The parts of a data line between commas; empty ones are left out.
std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (!line.empty()) {
    const std::size_t comma = line.find(',');
    const std::string_view field = trim(line.substr(0, comma));
    if (!field.empty()) fields.push_back(field);
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  return fields;
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  if (text.substr(0, 1) == "+") text.remove_prefix(1);
  return parse_number<Number>(text);
}

/// Keywords that say more of a material than its isotropic elasticity and its density.
bool is_of_material(const std::string& name) {
  static const std::set<std::string> kNames = {
      "plastic",        "hyperelastic", "hyperfoam",     "viscoelastic",
      "damping",        "expansion",    "user material", "anisotropic hyperelastic",
      "mullins effect", "creep",        "concrete",      "cap plasticity",
      "drucker prager", "mohr coulomb"};
  return kNames.contains(name);
}

}  // namespace

bool AbaqusMaterials::begin(const AbaqusKeyword& keyword, std::int64_t part) {
  data_ = Data::kNone;
  is_first_row_ = true;
  if (keyword.name == "elset") {
    open_set_ = {part, keyword.value("elset")};
    is_generated_ = keyword.parameters.contains("generate");
    // Sets of an assembly name elements of instances, which are not read as such.
    if (keyword.parameters.contains("instance")) {
      unread_.insert("elset of an instance");
      return false;
    }
    if (open_set_.second.empty()) return false;
    if (sets_.try_emplace(open_set_).second) set_order_.push_back(open_set_);
    data_ = Data::kSet;
  } else if (keyword.name == "material") {
    open_material_ = keyword.value("name");
    materials_.try_emplace(open_material_);
  } else if (keyword.name == "elastic" && !materials_.empty()) {
    const std::string type = keyword.value("type");
    if (!type.empty() && type != "isotropic" && type != "iso") {
      unread_.insert("elastic, type=" + type);
    } else {
      data_ = Data::kElastic;
    }
  } else if (keyword.name == "density" && !materials_.empty()) {
    data_ = Data::kDensity;
  } else if (keyword.name == "solid section") {
    sections_.push_back({{part, keyword.value("elset")}, keyword.value("material")});
  } else if (is_of_material(keyword.name)) {
    unread_.insert(keyword.name);
  }
  return data_ != Data::kNone;
}

void AbaqusMaterials::data(std::string_view line) {
  if (data_ == Data::kSet) {
    add_to_set(line);
  } else if (data_ != Data::kNone) {
    read_row(line);
  }
}

void AbaqusMaterials::add_to_set(std::string_view line) {
  const std::vector<std::string_view> fields = fields_of(line);
  Set& set = sets_[open_set_];
  if (is_generated_) {
    const auto first = fields.empty() ? std::nullopt : number_in<std::int64_t>(fields[0]);
    const auto last = fields.size() < 2 ? first : number_in<std::int64_t>(fields[1]);
    const auto step =
        fields.size() < 3 ? std::optional<std::int64_t>(1) : number_in<std::int64_t>(fields[2]);
    if (!first || !last || !step || *step < 1) return;
    set.runs.emplace_back(*first, *last);
    set.steps.push_back(*step);
    return;
  }
  for (const std::string_view field : fields) {
    if (const auto label = number_in<std::int64_t>(field)) {
      set.runs.emplace_back(*label, *label);
      set.steps.push_back(1);
    } else {
      set.others.push_back(to_lower(field));
    }
  }
}

/// Rows behind the first are of other temperatures.
void AbaqusMaterials::read_row(std::string_view line) {
  Elastic& material = materials_[open_material_];
  if (!is_first_row_) {
    ++material.rows;
    return;
  }
  is_first_row_ = false;
  const std::vector<std::string_view> fields = fields_of(line);
  const auto number = [&](std::size_t i) {
    return i < fields.size() ? number_in<double>(fields[i]) : std::nullopt;
  };
  if (data_ == Data::kDensity) {
    material.density = number(0);
  } else {
    material.youngs_modulus = number(0);
    material.poissons_ratio = number(1);
  }
}

void AbaqusMaterials::put(const std::string& set, std::int64_t part, std::int64_t label) {
  if (set.empty()) return;
  const SetName name{part, set};
  const auto [found, is_new] = sets_.try_emplace(name);
  if (is_new) set_order_.push_back(name);
  Set& members = found->second;
  if (!members.runs.empty() && members.steps.back() == 1 &&
      members.runs.back().second == label - 1) {
    members.runs.back().second = label;
  } else {
    members.runs.emplace_back(label, label);
    members.steps.push_back(1);
  }
}

/// Tets of the set and of the sets within it. @param budget  of steps; at 0 the rest is left out
std::set<int> AbaqusMaterials::tets_of(const SetName& name,
                                       const std::map<std::int64_t, int>& tet_of,
                                       std::int64_t part_stride, std::int64_t& budget) const {
  std::set<int> tets;
  std::set<SetName> visited{name};
  std::vector<SetName> waiting{name};
  while (!waiting.empty() && budget > 0) {
    const auto found = sets_.find(waiting.back());
    waiting.pop_back();
    if (found == sets_.end()) continue;
    const Set& set = found->second;
    const std::int64_t base = name.first * part_stride;
    budget -= 1 + static_cast<std::int64_t>(set.runs.size() + set.others.size());
    for (std::size_t i = 0; i < set.runs.size(); ++i) {
      const auto [first, last] = set.runs[i];
      if (first < 0 || first >= part_stride) continue;
      const std::int64_t end = base + std::min(last, part_stride - 1);
      // Loop over existing tets, not over the ids that a line may name.
      for (auto tet = tet_of.lower_bound(base + first); tet != tet_of.end() && tet->first <= end;
           ++tet, --budget) {
        if ((tet->first - base - first) % set.steps[i] == 0) tets.insert(tet->second);
      }
    }
    for (const std::string& other : set.others) {
      const SetName inner{name.first, other};
      if (visited.insert(inner).second) waiting.push_back(inner);
    }
  }
  return tets;
}

void AbaqusMaterials::assign(const Section& section, const std::set<int>& tets,
                             MeshBuilder& builder) const {
  const auto found = materials_.find(section.material);
  const std::string of_set =
      fmt::format("*SOLID SECTION of the set {}", in_quotes(section.set.second));
  if (tets.empty()) {
    builder.warn(fmt::format("{}: {}, it is not taken", of_set,
                             sets_.contains(section.set) ? "no tetrahedra are found in it"
                                                         : "the file has no such set"));
    return;
  }
  if (found == materials_.end()) {
    builder.warn(
        fmt::format("{}: the file has no material {}", of_set, in_quotes(section.material)));
    return;
  }
  const Elastic& given = found->second;
  if (!given.youngs_modulus || !given.poissons_ratio) {
    builder.warn(fmt::format("the material {} has no isotropic *ELASTIC: it is not taken",
                             in_quotes(section.material)));
    return;
  }
  bodies::Material material{*given.youngs_modulus, *given.poissons_ratio};
  if (given.density) {
    material.density = *given.density;
  } else {
    builder.warn(fmt::format("the material {} has no *DENSITY: {:g} kg/m^3 is taken",
                             in_quotes(section.material), material.density));
  }
  if (given.rows > 0) {
    builder.warn(fmt::format("the material {} depends on temperature: its first row is taken",
                             in_quotes(section.material)));
  }
  for (const int tet : tets) builder.set_material(static_cast<std::size_t>(tet), material);
  builder.warn(fmt::format(
      "{} tetrahedra of the set {} have the material {} of the file, read in Pa and kg/m^3: "
      "E {:g}, nu {:g}, density {:g}",
      tets.size(), in_quotes(section.set.second), in_quotes(section.material),
      material.youngs_modulus, material.poissons_ratio, material.density));
}

void AbaqusMaterials::store(MeshBuilder& builder, std::int64_t part_stride) const {
  if (sets_.empty() && materials_.empty() && sections_.empty() && unread_.empty()) return;
  std::map<std::int64_t, int> tet_of;
  for (std::size_t t = 0; t < builder.tet_count(); ++t)
    tet_of.emplace(builder.tet_label(t), static_cast<int>(t));
  // More of them would be work for minutes.
  constexpr std::size_t kMaxSections = 1000, kMaxGroups = 1000;
  std::int64_t budget = 2'000'000 + 20 * static_cast<std::int64_t>(builder.tet_count());
  for (std::size_t i = 0; i < std::min(sections_.size(), kMaxSections); ++i)
    assign(sections_[i], tets_of(sections_[i].set, tet_of, part_stride, budget), builder);
  if (sections_.size() > kMaxSections)
    builder.warn(
        fmt::format("of {} solid sections the first {} are taken", sections_.size(), kMaxSections));
  if (sections_.empty() && !materials_.empty()) {
    builder.warn(fmt::format("the file has {} materials and no *SOLID SECTION: they are not taken",
                             materials_.size()));
  }
  for (const std::string& keyword : unread_)
    builder.warn(fmt::format("*{} is not read", keyword.substr(0, 60)));
  for (std::size_t i = 0; i < std::min(set_order_.size(), kMaxGroups); ++i) {
    const std::set<int> tets = tets_of(set_order_[i], tet_of, part_stride, budget);
    if (tets.empty() || tets.size() == builder.tet_count()) continue;
    builder.add_group({set_order_[i].second.substr(0, 128), {tets.begin(), tets.end()}});
  }
  if (budget <= 0) builder.warn("the element sets are so entangled that not all of them are read");
}

}  // namespace limber::scene::formats
