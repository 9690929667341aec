#include "engine/scene/formats/beam_job.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "engine/base/checked_number.h"
#include "engine/base/error.h"
#include "engine/base/index.h"
#include "engine/base/nearest_name.h"
#include "engine/scene/formats/edge_formats.h"
#include "engine/scene/formats/json_reader.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::scene {
namespace {

using formats::Json;

[[noreturn]] void refuse_job(const std::string& field, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, field, field + " " + why);
}

Json parse(std::string_view text, const char* name) {
  return formats::parse_object(text, [&](const std::string& why) { refuse_job(name, why); });
}

constexpr int kMostVertices = 2000000000;

/// Keys of a job; "meshLabel" is read by the public code alone.
constexpr std::string_view kJobKeys[] = {
    "label",  "mesh filename",        "meshLabel",     "cross section dim", "beam material",
    "forces", "forced displacements", "fixed vertices"};
/// Only these settings are read; the public code has many more, different in each version.
constexpr std::string_view kSettingsKeys[] = {"initialDistortion"};
constexpr std::string_view kDistortionKeys[] = {"duration", "load"};

bool is_one_of(std::string_view key, std::span<const std::string_view> keys) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

/// Refuses keys that are none of these, e.g. "force" for "forces", which would be passed over.
void check_keys(const Json& object, std::span<const std::string_view> keys, const char* what) {
  for (const auto& [key, value] : object.items()) {
    if (is_one_of(key, keys)) continue;
    const std::string_view meant = nearest_name(key, keys);
    std::string why = std::string("is no key of ") + what;
    if (!meant.empty()) {
      why += ": did you mean \"" + std::string(meant) + "\"?";
    } else {
      why += ", which are";
      for (const std::string_view known : keys) {
        why += known == keys.front() ? " \"" : ", \"";
        why += std::string(known) + '"';
      }
    }
    refuse_job(key, why);
  }
}

double read_number(const Json& value, const std::string& field) {
  if (!value.is_number()) refuse_job(field, "is not a number");
  const auto result = value.get<double>();  // of whole numbers, too
  if (!std::isfinite(result)) refuse_job(field, "is not finite");
  return result;
}

/// Value of a number that is written as a whole one. Json's own conversion would cut off its upper
/// bits.
/// @returns nothing beyond `most`
std::optional<int> read_count(const Json& value, int most) {
  std::optional<int> count;
  if (const auto* number = value.get_ptr<const Json::number_unsigned_t*>())
    count = to_whole<int>(*number);
  else if (const auto* signed_number = value.get_ptr<const Json::number_integer_t*>())
    count = to_whole<int>(*signed_number);
  return count && *count >= 0 && *count <= most ? count : std::nullopt;
}

/// @returns the array under `name`, null where it is absent
const Json* list(const Json& from, const char* name) {
  const auto found = from.find(name);
  if (found == from.end() || found->is_null()) return nullptr;
  if (!found->is_array()) refuse_job(name, "is not a list");
  return &*found;
}

std::vector<double> numbers(const Json& value, std::size_t count, const std::string& field) {
  if (!value.is_array() || value.size() != count)
    refuse_job(field, "is not a list of " + std::to_string(count) + " numbers");
  std::vector<double> result;
  for (const Json& entry : value) result.push_back(read_number(entry, field));
  return result;
}

/// Entries [vertex, list] of a member.
template <class Visit>
void for_each_vertex(const Json& job, const char* name, Visit&& visit) {
  const Json* const entries = list(job, name);
  if (entries == nullptr) return;
  for (std::size_t i = 0; i < entries->size(); ++i) {
    const std::string field = std::string(name) + "[" + std::to_string(i) + "]";
    const Json& entry = (*entries)[i];
    const bool is_pair = entry.is_array() && entry.size() == 2;
    const auto vertex = is_pair ? read_count(entry[0], kMostVertices) : std::nullopt;
    if (!vertex) refuse_job(field, "is not [vertex, numbers]");
    visit(*vertex, entry[1], field);
  }
}

std::array<double, 2> pair(const Json& job, const char* name) {
  const auto found = job.find(name);
  if (found == job.end()) refuse_job(name, "is missing");
  const auto values = numbers(*found, 2, name);
  return {values[0], values[1]};
}

std::string text(const Json& job, const char* name) {
  const auto found = job.find(name);
  if (found == job.end()) return {};
  if (!found->is_string()) refuse_job(name, "is not a text");
  return found->get<std::string>();
}

void read_settings(std::string_view settings, BeamJob& job) {
  const Json document = parse(settings, "DRMSettings.json");
  for (const auto& [key, value] : document.items()) {
    const std::string_view meant = nearest_name(key, kSettingsKeys);
    if (!meant.empty() && meant != key)
      refuse_job(key,
                 "is no key of DRMSettings.json: did you mean \"" + std::string(meant) + "\"?");
  }
  const auto distortion = document.find("initialDistortion");
  if (distortion == document.end() || distortion->is_null()) return;
  if (distortion->is_object()) check_keys(*distortion, kDistortionKeys, "initialDistortion");
  if (!distortion->is_object() || !distortion->contains("load"))
    refuse_job("initialDistortion", "has no load");
  const auto load = numbers((*distortion)["load"], 6, "initialDistortion.load");
  job.initial_force = Eigen::Vector3d(load[0], load[1], load[2]);
  job.initial_moment = Eigen::Vector3d(load[3], load[4], load[5]);
}

}  // namespace

BeamJob read_beam_job(std::string_view content, std::string_view settings) {
  const Json document = parse(content, "SimulationJob.json");
  check_keys(document, kJobKeys, "SimulationJob.json");
  BeamJob job;
  job.label = text(document, "label");
  job.mesh_file = text(document, "mesh filename");
  if (job.mesh_file.empty()) refuse_job("mesh filename", "is missing");
  const auto [width, height] = pair(document, "cross section dim");
  job.section_width = width;
  job.section_height = height;
  const auto [poisson, young] = pair(document, "beam material");
  job.poisson = poisson;
  job.young = young;
  for_each_vertex(document, "fixed vertices",
                  [&](int vertex, const Json& value, const auto& field) {
                    if (!value.is_array()) refuse_job(field, "is not [vertex, list]");
                    BeamJob::Fixed fixed;
                    fixed.vertex = vertex;
                    for (const Json& direction : value) {
                      const auto place = read_count(direction, 5);
                      if (!place) refuse_job(field, "has a direction that is not 0 to 5");
                      fixed.directions[index(*place)] = true;
                    }
                    job.fixed.push_back(fixed);
                  });
  for_each_vertex(document, "forces", [&](int vertex, const Json& value, const auto& field) {
    const auto f = numbers(value, 6, field);
    job.forces.push_back({vertex, {f[0], f[1], f[2]}, {f[3], f[4], f[5]}});
  });
  for_each_vertex(document, "forced displacements",
                  [&](int vertex, const Json& value, const auto& field) {
                    const auto d = numbers(value, 3, field);
                    job.displacements.push_back({vertex, {d[0], d[1], d[2]}});
                  });
  if (!settings.empty()) read_settings(settings, job);
  return job;
}

BeamJobFiles read_beam_job_folder(const std::filesystem::path& folder) {
  const std::filesystem::path settings = folder / "DRMSettings.json";
  BeamJobFiles result;
  result.job =
      read_beam_job(read_bytes(folder / "SimulationJob.json"),
                    std::filesystem::exists(settings) ? read_bytes(settings) : std::string());
  // A file name only: jobs do not reach out of their folder.
  result.mesh =
      read_edge_mesh_file(folder / std::filesystem::path(result.job.mesh_file).filename());
  return result;
}

}  // namespace limber::scene
