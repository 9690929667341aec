#include "server/kinds/bodies/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <unordered_map>
#include <utility>

#include "engine/scene/formats/precision.h"
#include "engine/scene/keyframe_rules.h"
#include "engine/scene/pinned_motion.h"
#include "server/kinds/bodies/base_motions.h"
#include "server/kinds/bodies/keyframe.h"
#include "server/kinds/bodies/simulation.h"
#include "server/kinds/bodies/stiffness.h"
#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"

namespace limber::server {
namespace {

/// Fields of scenes of other kinds have numbers from here on, but for those that were added later.
constexpr int kFirstOfOtherKinds = 20;
constexpr std::array<int, 2> kLaterOfBodies{proto::Scene::kStartFieldNumber,
                                            proto::Scene::kPaintedStiffnessFieldNumber};

/// The first field that a scene of a body has not; null where there is none.
const google::protobuf::FieldDescriptor* foreign_field(const proto::Scene& message) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  const auto found = std::find_if(fields.begin(), fields.end(), [](const auto* field) {
    return field->number() >= kFirstOfOtherKinds &&
           std::find(kLaterOfBodies.begin(), kLaterOfBodies.end(), field->number()) ==
               kLaterOfBodies.end();
  });
  return found == fields.end() ? nullptr : *found;
}

bodies::Material decode_material(const proto::Material& message) {
  bodies::Material material;
  if (message.has_youngs_modulus()) material.youngs_modulus = message.youngs_modulus();
  if (message.has_poissons_ratio()) material.poissons_ratio = message.poissons_ratio();
  if (message.has_density()) material.density = message.density();
  return material;
}

proto::Material encode_material(const bodies::Material& material) {
  proto::Material message;
  message.set_youngs_modulus(material.youngs_modulus);
  message.set_poissons_ratio(material.poissons_ratio);
  message.set_density(material.density);
  return message;
}

constexpr EnumTable<scene::Basis, proto::Basis, proto::Basis_MAX> kBases{
    {scene::Basis::kBest, proto::BASIS_BEST},
    {scene::Basis::kSnapshots, proto::BASIS_SNAPSHOTS},
    {scene::Basis::kModalDerivatives, proto::BASIS_MODAL_DERIVATIVES},
    {scene::Basis::kMapDerivatives, proto::BASIS_MAP_DERIVATIVES}};

constexpr EnumTable<scene::Cubature, proto::Cubature, proto::Cubature_MAX> kCubatures{
    {scene::Cubature::kFittedMaps, proto::CUBATURE_FITTED_MAPS},
    {scene::Cubature::kWeights, proto::CUBATURE_WEIGHTS}};

constexpr EnumTable<scene::Discretisation, proto::TimeDiscretisation, proto::TimeDiscretisation_MAX>
    kDiscretisations{{scene::Discretisation::kDifferences, proto::TIME_DISCRETISATION_DIFFERENCES},
                     {scene::Discretisation::kSampled, proto::TIME_DISCRETISATION_SAMPLED}};

constexpr EnumTable<scene::End, proto::EndCondition, proto::EndCondition_MAX> kEndConditions{
    {scene::End::kPinnedPositionVelocity, proto::END_CONDITION_PINNED_POSITION_VELOCITY},
    {scene::End::kPinnedPosition, proto::END_CONDITION_PINNED_POSITION},
    {scene::End::kCyclic, proto::END_CONDITION_CYCLIC},
    {scene::End::kFree, proto::END_CONDITION_FREE}};

constexpr EnumTable<scene::MaterialVariables, proto::MaterialVariables,
                    proto::MaterialVariables_MAX>
    kMaterialVariables{{scene::MaterialVariables::kMotion, proto::MATERIAL_VARIABLES_MOTION},
                       {scene::MaterialVariables::kDynamics, proto::MATERIAL_VARIABLES_DYNAMICS},
                       {scene::MaterialVariables::kAll, proto::MATERIAL_VARIABLES_ALL}};

scene::ModelRequest decode_model(const proto::ModelRequest& message, const std::string& field,
                                 Faults& faults) {
  scene::ModelRequest model;
  const auto read = [&](std::uint32_t value, const char* name, int& into) {
    faults.try_to([&] { into = decode_index(value, field + name); });
  };
  if (message.has_modes()) {
    read(message.modes(), ".modes", model.mode_count);
    model.modes_by = scene::ModelRequest::ModesBy::kScene;
  }
  if (message.has_tolerance()) model.tolerance = message.tolerance();
  read(message.basis_size(), ".basis_size", model.basis_size);
  read(message.cubature_size(), ".cubature_size", model.cubature_size);
  read(message.candidate_modes(), ".candidate_modes", model.candidate_modes);
  model.basis = kBases.decode(message.basis());
  model.cubature = kCubatures.decode(message.cubature());
  return model;
}

std::string names_of(const std::vector<scene::MeshGroup>& groups) {
  constexpr std::size_t kListed = 10;
  std::string names;
  for (std::size_t g = 0; g < std::min(groups.size(), kListed); ++g)
    names +=
        fmt::format("{}{} ({} tets)", g > 0 ? ", " : "", groups[g].name, groups[g].tets.size());
  return names + (groups.size() > kListed ? ", ..." : "");
}

/// Materials that no tet has are left out, so that scenes do not grow by being saved and opened.
/// The others keep their order, and those of groups stay: body_field_in() counts them from the end.
void drop_unused_materials(bodies::TetMesh& mesh, int groups) {
  const std::size_t first_of_group = mesh.materials.size() - static_cast<std::size_t>(groups);
  std::vector<char> is_used(mesh.materials.size(), 0);
  for (const int material : mesh.tet_material) is_used[static_cast<std::size_t>(material)] = 1;
  std::vector<int> number(mesh.materials.size(), -1);
  std::vector<bodies::Material> used;
  for (std::size_t material = 0; material < number.size(); ++material) {
    if (is_used[material] == 0 && material < first_of_group) continue;
    number[material] = static_cast<int>(used.size());
    used.push_back(mesh.materials[material]);
  }
  for (int& material : mesh.tet_material) material = number[static_cast<std::size_t>(material)];
  mesh.materials = std::move(used);
}

/// Groups override what the mesh brings: tets of no group keep the mesh's material, or the scene's.
void apply_groups(const proto::Scene& message, const std::string& prefix,
                  const bodies::Material& fallback, bodies::TetMesh& mesh, Faults& faults) {
  if (message.material_groups_size() == 0) return;
  const auto tets = static_cast<std::size_t>(mesh.tet_count());
  if (mesh.materials.empty()) {
    mesh.materials = {fallback};
    mesh.tet_material.assign(tets, 0);
  }
  std::unordered_map<std::size_t, int> group_of;  // without a mesh, too, no tet is in two groups
  for (int g = 0; g < message.material_groups_size(); ++g) {
    const auto& group = message.material_groups(g);
    const std::string list = fmt::format("{}material_groups[{}].tets", prefix, g);
    mesh.materials.push_back(decode_material(group.material()));
    faults.try_each(list, group.tets_size(), [&](int i) {
      const std::size_t tet = group.tets(i);
      if (tets > 0 && tet >= tets) {
        throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, fmt::format("{}[{}]", list, i),
                      fmt::format("tet {} of {}", tet, tets));
      }
      const int owner = group_of.try_emplace(tet, g).first->second;
      if (owner != g) {
        throw invalid(fmt::format("{}[{}]", list, i),
                      fmt::format("tet {} is in group {} too", tet, owner));
      }
      if (tets > 0) mesh.tet_material[tet] = static_cast<int>(mesh.materials.size()) - 1;
    });
  }
  if (tets > 0) drop_unused_materials(mesh, message.material_groups_size());
}

bool are_disjoint(const std::vector<scene::MeshGroup>& groups, int tets) {
  std::vector<char> is_taken(static_cast<std::size_t>(tets), 0);
  for (const scene::MeshGroup& group : groups) {
    for (const int tet : group.tets)
      if (std::exchange(is_taken[static_cast<std::size_t>(tet)], 1) != 0) return false;
  }
  return true;
}

/// Groups of a file that gives them no material become groups of the scene, with its material.
void take_groups(const proto::Scene& message, const std::vector<scene::MeshGroup>& groups,
                 DecodedScene& decoded) {
  bodies::TetMesh& mesh = decoded.scene.mesh;
  if (groups.empty() || !mesh.materials.empty() || message.material_groups_size() > 0) return;
  std::string text =
      fmt::format("the file has groups of tets without a material: {}. ", names_of(groups));
  if (are_disjoint(groups, mesh.tet_count())) {
    mesh.materials.assign(groups.size(), decoded.scene.material);
    mesh.tet_material.assign(static_cast<std::size_t>(mesh.tet_count()), -1);
    bool is_rest = false;
    for (std::size_t g = 0; g < groups.size(); ++g)
      for (const int tet : groups[g].tets)
        mesh.tet_material[static_cast<std::size_t>(tet)] = static_cast<int>(g);
    for (int& material : mesh.tet_material) {
      if (material >= 0) continue;
      material = static_cast<int>(groups.size());
      is_rest = true;
    }
    if (is_rest) mesh.materials.push_back(decoded.scene.material);
    text += "They are the scene's material_groups in this order, with the scene's material.";
  } else {
    text += "They overlap: all tets get the scene's material.";
  }
  decoded.mesh_warnings.push_back(text + " material_groups of the scene give them their own");
}

/// A mesh that brings materials leaves the scene's without effect, wholly.
void warn_of_unused_material(const proto::Scene& message, DecodedScene& decoded) {
  const auto& given = message.material();
  const auto& materials = decoded.scene.mesh.materials;
  if (materials.empty() ||
      (!given.has_youngs_modulus() && !given.has_poissons_ratio() && !given.has_density()))
    return;
  const bodies::Material& scenes = decoded.scene.material;
  const bool is_same = std::all_of(materials.begin(), materials.end(),
                                   [&](const auto& material) { return material == scenes; });
  std::ptrdiff_t grouped = 0;
  for (const auto& group : message.material_groups()) grouped += group.tets_size();
  if (is_same || grouped >= decoded.scene.mesh.tet_count()) return;
  const auto [low, high] = std::minmax_element(
      materials.begin(), materials.end(),
      [](const auto& a, const auto& b) { return a.youngs_modulus < b.youngs_modulus; });
  const std::string range =
      low->youngs_modulus == high->youngs_modulus
          ? fmt::format("{:g} Pa", low->youngs_modulus)
          : fmt::format("{:g} to {:g} Pa", low->youngs_modulus, high->youngs_modulus);
  decoded.material_warning = fmt::format(
      "the scene's material (youngs_modulus {:g} Pa) is ignored: the mesh file brings "
      "its own (youngs_modulus {}); material_groups override it",
      scenes.youngs_modulus, range);
}

void check_frames(const proto::Scene& message, const std::string& prefix,
                  const SceneLimits& limits) {
  if (limits.frames > 0 && message.frames() > limits.frames) {
    throw limit_exceeded(prefix + "frames", "frames", limits.frames, message.frames());
  }
}

void check_constraints(const proto::Scene& message, const std::string& prefix,
                       const SceneLimits& limits) {
  const auto constraints = static_cast<std::uint64_t>(message.constraints_size());
  if (limits.constraints > 0 && constraints > limits.constraints) {
    throw limit_exceeded(prefix + "constraints", "constraints", limits.constraints, constraints);
  }
}

void check_keyframes(const proto::Scene& message, const std::string& prefix) {
  if (message.keyframes_size() > scene::kMaxKeyframes) {
    throw limit_exceeded(prefix + "keyframes", "keyframes", scene::kMaxKeyframes,
                         static_cast<std::uint64_t>(message.keyframes_size()));
  }
}

LoadedMesh load(const proto::MeshSource& source, const std::string& field,
                const MeshLoader& load_mesh) {
  switch (source.source_case()) {
    case proto::MeshSource::kArrays:
      return {decode_mesh(source.arrays(), field + ".arrays"), {}};
    case proto::MeshSource::SOURCE_NOT_SET:
      throw invalid(field, "a scene needs a mesh: path, file, arrays or sample");
    default:
      return load_mesh(source, field);
  }
}

LoadedMesh load_within(const proto::MeshSource& source, const std::string& field,
                       const SceneLimits& limits, const MeshLoader& load_mesh) {
  LoadedMesh loaded = load(source, field, load_mesh);
  const auto tets = static_cast<std::uint64_t>(loaded.mesh.tet_count());
  if (limits.mesh_tets > 0 && tets > limits.mesh_tets)
    throw limit_exceeded(field, "tets", limits.mesh_tets, tets);
  return loaded;
}

/// Point caches of bodies far from the origin are relative to their middle, as exports write them.
/// @param displacements  3 nodes x frames; of such a motion the origin is added
void restore_origin(const bodies::NodePositions& nodes, Eigen::MatrixXd& displacements) {
  const Eigen::Vector3d origin = scene::origin_for(nodes);
  if (origin.isZero(0) || displacements.size() == 0) return;
  const Eigen::Vector3d mean = displacements.col(0).reshaped(3, nodes.cols()).rowwise().mean();
  if ((mean + origin).norm() >= mean.norm()) return;
  const Eigen::VectorXd shift = origin.replicate(nodes.cols(), 1);
  displacements.colwise() += shift;
}

}  // namespace

Eigen::MatrixXd decode_pin_paths(const proto::Array& message, const std::string& field,
                                 const scene::Scene& scene) {
  if (scene.fixed_nodes.empty()) throw invalid(field, "the scene has no fixed nodes to animate");
  return decode_motion(message, field, static_cast<int>(scene.fixed_nodes.size()),
                       scene.frame_count);
}

namespace {

Eigen::MatrixXd decode_pins(const proto::Array& message, const std::string& field,
                            const scene::Scene& scene) {
  const int nodes = scene.mesh.node_count();
  std::set<int> distinct;
  for (const int node : scene.fixed_nodes)
    if (node < 0 || node >= nodes || !distinct.insert(node).second) return {};  // complained about
  const Eigen::MatrixXd positions = decode_pin_paths(message, field, scene);
  if (const auto fault = scene::pins_fault(scene, positions))
    throw Error(fault->code, field, fault->message);
  return scene::motion_of_pins(scene.mesh, scene.fixed_nodes, positions);
}

Eigen::MatrixXd decode_base_motion(const proto::BaseMotion& message, const std::string& field,
                                   const scene::Scene& scene, const MotionReader& read_motion) {
  if (message.source_case() == proto::BaseMotion::SOURCE_NOT_SET) return {};
  const int nodes = scene.mesh.node_count();
  const bool comparable = nodes > 0;
  const std::string source = field + "." + field_in(message, "");
  if (message.has_pins())
    return comparable ? decode_pins(message.pins(), field + ".pins", scene) : Eigen::MatrixXd();
  Eigen::MatrixXd positions;
  if (message.has_positions()) {
    check_array(message.positions(), source, 3);
    if (!comparable) return {};
    positions = decode_motion(message.positions(), source, nodes, scene.frame_count);
  } else {
    positions = read_motion(message, field, nodes);
    if (!comparable) return {};
  }
  if (positions.rows() != 3 * static_cast<Eigen::Index>(nodes)) {
    throw invalid(source,
                  fmt::format("has {} nodes, the mesh has {}", positions.rows() / 3, nodes));
  }
  if (positions.cols() != scene.frame_count) {
    throw invalid(source, fmt::format("has {} frames, the scene has {}", positions.cols(),
                                      scene.frame_count));
  }
  positions.colwise() -=
      Eigen::Map<const Eigen::VectorXd>(scene.mesh.nodes.data(), scene.mesh.nodes.size());
  if (is_point_cache(message)) restore_origin(scene.mesh.nodes, positions);
  return positions;
}

}  // namespace

bodies::TetMesh decode_mesh(const proto::MeshArrays& message, const std::string& field) {
  bodies::TetMesh mesh;
  mesh.nodes = decode_points(message.nodes(), field + ".nodes");
  mesh.tets = decode_tets(message.tets(), field + ".tets");
  return mesh;
}

proto::MeshArrays encode_mesh(const bodies::TetMesh& mesh) {
  proto::MeshArrays message;
  *message.mutable_nodes() = encode_points_float64(mesh.nodes);
  *message.mutable_tets() = encode_indices(mesh.tets);
  return message;
}

scene::End decode_end(proto::EndCondition end) { return kEndConditions.decode(end); }
proto::EndCondition encode_end(scene::End end) { return kEndConditions.encode(end); }

scene::MaterialVariables decode_variables(proto::MaterialVariables variables) {
  return kMaterialVariables.decode(variables);
}

proto::MaterialVariables encode_variables(scene::MaterialVariables variables) {
  return kMaterialVariables.encode(variables);
}

scene::DynamicsRequest decode_dynamics(const proto::Dynamics& message) {
  scene::DynamicsRequest dynamics;
  if (message.has_frames_per_second()) dynamics.frames_per_second = message.frames_per_second();
  if (message.has_period_frames()) dynamics.period_frames = message.period_frames();
  if (message.has_damping_ratio()) dynamics.damping_ratio = message.damping_ratio();
  if (message.has_force_smoothing()) dynamics.force_smoothing = message.force_smoothing();
  if (message.has_inertia()) dynamics.inertia = message.inertia();
  if (message.discretisation() != proto::TIME_DISCRETISATION_UNSPECIFIED)
    dynamics.discretisation = kDiscretisations.decode(message.discretisation());
  return dynamics;
}

proto::Dynamics encode_dynamics(const scene::Dynamics& dynamics) {
  proto::Dynamics message;
  message.set_frames_per_second(dynamics.frames_per_second);
  message.set_period_frames(dynamics.period_frames);
  message.set_damping_ratio(dynamics.damping_ratio);
  message.set_force_smoothing(dynamics.force_smoothing);
  if (dynamics.inertia != 0) message.set_inertia(dynamics.inertia);
  message.set_discretisation(kDiscretisations.encode(dynamics.discretisation));
  return message;
}

std::shared_ptr<const scene::StartMotion> decode_start(const proto::Scene& message,
                                                       const std::string& field) {
  const proto::ModalMotion& given = message.start();
  auto start = std::make_shared<scene::StartMotion>();
  start->coordinates = decode_matrix(given.coordinates(), field + ".coordinates");
  if (start->coordinates.cols() != Eigen::Index{message.frames()})
    throw invalid(
        field + ".coordinates.shape",
        fmt::format("{} frames, the scene has {}", start->coordinates.cols(), message.frames()));
  if (given.has_mixing()) start->mixing = decode_matrix(given.mixing(), field + ".mixing");
  start->stiffness = decode_numbers(given.stiffness());
  start->damping = decode_numbers(given.damping());
  for (const auto& [numbers, name] :
       {std::pair{&start->stiffness, ".stiffness"}, std::pair{&start->damping, ".damping"}}) {
    if (!(numbers->array() >= 0).all() || !numbers->allFinite())
      throw invalid(field + name, "finite numbers >= 0 are expected");
  }
  if (given.weight_scale() != 0) start->weight_scale = given.weight_scale();
  if (!(start->weight_scale > 0) || !(start->weight_scale <= scene::kGreatestWeight))
    throw invalid(field + ".weight_scale",
                  fmt::format("{} must be > 0 and at most {:g}", start->weight_scale,
                              scene::kGreatestWeight));
  return start;
}

proto::ModalMotion encode_start(const session::BodyResult& result) {
  proto::ModalMotion start;
  *start.mutable_coordinates() = encode_matrix(result.modal);
  if (result.material != result.initial_material) {
    *start.mutable_mixing() = encode_matrix(result.material->mixing);
    encode_numbers(result.material->dynamics.stiffness, *start.mutable_stiffness());
    encode_numbers(result.material->dynamics.damping, *start.mutable_damping());
  }
  if (result.weight_scale != 1) start.set_weight_scale(result.weight_scale);
  return start;
}

DecodedScene decode_scene(const proto::Scene& message, const std::string& prefix,
                          const SceneLimits& limits, const SceneReaders& readers) {
  Faults faults(Faults::Mode::kThrow);
  return decode_scene(message, prefix, limits, readers, faults);
}

DecodedScene decode_scene(const proto::Scene& message, const std::string& prefix,
                          const SceneLimits& limits, const SceneReaders& readers, Faults& faults) {
  DecodedScene decoded;
  scene::Scene& scene = decoded.scene;
  faults.try_to([&] { check_frames(message, prefix, limits); });
  const bool few = faults.try_to([&] { check_constraints(message, prefix, limits); });
  scene.name = message.name();
  if (message.has_length_unit_in_metres())
    scene.length_unit_in_metres = message.length_unit_in_metres();
  scene.material = decode_material(message.material());
  if (message.has_merge_tolerance()) scene.merge_tolerance = message.merge_tolerance();
  scene.frame_count = std::numeric_limits<int>::max();
  faults.try_to([&] { scene.frame_count = decode_index(message.frames(), prefix + "frames"); });
  scene.first_end = decode_end(message.first_end());
  scene.last_end = decode_end(message.last_end());
  scene.dynamics = decode_dynamics(message.dynamics()).resolved(scene::Discretisation::kSampled);
  if (!message.dynamics().has_inertia()) scene.dynamics.inertia = message.base_motion().inertia();
  scene.model = decode_model(message.model(), prefix + "model", faults);
  scene.material_optimisation.variables =
      decode_variables(message.material_optimisation().variables());
  if (message.material_optimisation().has_column_weight())
    scene.material_optimisation.column_weight = message.material_optimisation().column_weight();
  if (message.material_optimisation().has_max_frequency_hz())
    scene.material_optimisation.max_frequency_hz =
        message.material_optimisation().max_frequency_hz();
  if (message.material_optimisation().has_slow_steps()) {
    faults.try_to([&] {
      scene.material_optimisation.slow_steps =
          decode_index(message.material_optimisation().slow_steps(),
                       prefix + "material_optimisation.slow_steps");
    });
  }
  if (message.has_constraint_tolerance())
    scene.constraint_tolerance = message.constraint_tolerance();
  scene.fixed_nodes.assign(static_cast<std::size_t>(message.fixed_nodes_size()),
                           std::numeric_limits<int>::max());
  faults.try_each(prefix + "fixed_nodes", message.fixed_nodes_size(), [&](int i) {
    scene.fixed_nodes[static_cast<std::size_t>(i)] =
        decode_index(message.fixed_nodes(i), fmt::format("{}fixed_nodes[{}]", prefix, i));
  });
  for (int i = 0; few && i < message.constraints_size(); ++i) {
    scene.constraints.push_back(decode_constraint(
        message.constraints(i), fmt::format("{}constraints[{}]", prefix, i), faults));
  }
  faults.try_to([&] {
    LoadedMesh loaded = load_within(message.mesh(), prefix + "mesh", limits, readers.mesh);
    scene.mesh = std::move(loaded.mesh);
    decoded.mesh_warnings = std::move(loaded.warnings);
    warn_of_unused_material(message, decoded);
    take_groups(message, loaded.groups, decoded);
  });
  apply_groups(message, prefix, scene.material, scene.mesh, faults);
  faults.try_to([&] {
    scene.base_motion =
        decode_base_motion(message.base_motion(), prefix + "base_motion", scene, readers.motion);
  });
  const bool few_poses = faults.try_to([&] { check_keyframes(message, prefix); });
  for (int i = 0; few_poses && i < message.keyframes_size(); ++i) {
    scene.keyframes.push_back(decode_keyframe(message.keyframes(i),
                                              fmt::format("{}keyframes[{}]", prefix, i),
                                              scene.mesh.nodes, readers.mesh, faults));
  }
  if (message.has_surface()) {
    faults.try_to([&] {
      scene.surface = std::make_shared<const scene::DetailedSurface>(
          readers.surface(message.surface(), prefix + "surface"));
    });
  }
  if (message.has_painted_stiffness()) {
    faults.try_to([&] {
      paint_stiffness(message.painted_stiffness(), prefix + "painted_stiffness", readers.stiffness,
                      scene);
    });
  }
  if (message.has_start())
    faults.try_to([&] { scene.start = decode_start(message, prefix + "start"); });
  if (message.has_simulation()) {
    scene.simulation = decode_simulation(message.simulation(), prefix + "simulation",
                                         scene.mesh.node_count(), faults);
  }
  return decoded;
}

proto::Scene encode_scene(const scene::Scene& scene) {
  proto::Scene message;
  message.set_name(scene.name);
  message.set_length_unit_in_metres(scene.length_unit_in_metres);
  *message.mutable_material() = encode_material(scene.material);
  for (const auto& material : scene.mesh.materials)
    *message.add_material_groups()->mutable_material() = encode_material(material);
  for (std::size_t tet = 0; tet < scene.mesh.tet_material.size(); ++tet) {
    message.mutable_material_groups(scene.mesh.tet_material[tet])
        ->add_tets(static_cast<std::uint32_t>(tet));
  }
  if (scene.merge_tolerance) message.set_merge_tolerance(*scene.merge_tolerance);
  for (const int node : scene.fixed_nodes)
    message.add_fixed_nodes(static_cast<std::uint32_t>(node));
  message.set_frames(static_cast<std::uint32_t>(scene.frame_count));
  message.set_first_end(kEndConditions.encode(scene.first_end));
  message.set_last_end(kEndConditions.encode(scene.last_end));
  *message.mutable_dynamics() = encode_dynamics(scene.dynamics);
  auto* model = message.mutable_model();
  if (scene.model.names_modes())
    model->set_modes(static_cast<std::uint32_t>(scene.model.mode_count));
  model->set_tolerance(scene.model.tolerance);
  model->set_basis_size(static_cast<std::uint32_t>(scene.model.basis_size));
  model->set_cubature_size(static_cast<std::uint32_t>(scene.model.cubature_size));
  model->set_cubature(kCubatures.encode(scene.model.cubature));
  model->set_basis(kBases.encode(scene.model.basis));
  model->set_candidate_modes(static_cast<std::uint32_t>(scene.model.candidate_modes));
  auto* optimisation = message.mutable_material_optimisation();
  optimisation->set_variables(encode_variables(scene.material_optimisation.variables));
  if (scene.constraint_tolerance) message.set_constraint_tolerance(*scene.constraint_tolerance);
  optimisation->set_column_weight(scene.material_optimisation.column_weight);
  if (scene.material_optimisation.max_frequency_hz)
    optimisation->set_max_frequency_hz(*scene.material_optimisation.max_frequency_hz);
  optimisation->set_slow_steps(static_cast<std::uint32_t>(scene.material_optimisation.slow_steps));
  for (const auto& constraint : scene.constraints)
    *message.add_constraints() = encode_constraint(constraint);
  for (const auto& keyframe : scene.keyframes) *message.add_keyframes() = encode_keyframe(keyframe);
  if (scene.simulation) *message.mutable_simulation() = encode_simulation(*scene.simulation);
  return message;
}

proto::BaseMotion encode_base_motion(const scene::Scene& scene) {
  const Eigen::Map<const Eigen::VectorXd> rest(scene.mesh.nodes.data(), scene.mesh.nodes.size());
  const Eigen::MatrixXd positions = scene.base_motion.colwise() + rest;
  proto::BaseMotion message;
  *message.mutable_positions() = encode_motion(positions);
  return message;
}

bool is_body(const proto::Scene& message) { return foreign_field(message) == nullptr; }

void leave_simulation(proto::Scene& message) {
  message.clear_base_motion();
  message.clear_constraints();
  message.clear_keyframes();
}

void demand_body(const proto::Scene& message, const std::string& prefix) {
  if (const auto* field = foreign_field(message))
    throw invalid(prefix + field->name(), "an elastic body is expected");
}

}  // namespace limber::server
