#pragma once

#include <functional>
#include <memory>
#include <string>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/scene.h"
#include "engine/scene/start_motion.h"
#include "engine/session/bodies/session.h"
#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"
#include "server/wire/faults.h"

namespace limber::server {

/// Upper limits on a scene; 0: no limit.
struct SceneLimits {
  std::uint64_t mesh_tets = 0;
  std::uint32_t frames = 0;
  std::uint32_t constraints = 0;
  std::uint64_t session_bytes = 0;  // estimated
};

/// A mesh and what its reader skipped or supposed.
struct LoadedMesh {
  bodies::TetMesh mesh;
  std::vector<std::string> warnings;
  std::vector<scene::MeshGroup> groups = {};
};

/// Resolves every source but arrays: files, samples. `field` is the path of the source for errors.
using MeshLoader =
    std::function<LoadedMesh(const proto::MeshSource& source, const std::string& field)>;
/// Resolves every base motion but arrays: positions, 3 nodes x frames. `field` is the path of the
/// motion for errors; `nodes` are those of the mesh.
using MotionReader = std::function<Eigen::MatrixXd(const proto::BaseMotion& motion,
                                                   const std::string& field, int nodes)>;

/// Reads the surface that a scene names. `field` is its path for errors.
using SurfaceReader = std::function<scene::DetailedSurface(const proto::SurfaceSource& source,
                                                           const std::string& field)>;

/// The bytes of a file that a message names. @throws Refusal or Error naming `field`
using FileReader = std::function<std::string(const std::string& path, const std::string& field)>;

/// How what a scene names is read.
struct SceneReaders {
  MeshLoader mesh;
  MotionReader motion;
  SurfaceReader surface;
  FileReader stiffness = {};
};

struct DecodedScene {
  scene::Scene scene;
  std::vector<std::string> mesh_warnings;
  std::string material_warning;  // that the scene's material has no effect; empty if it has
};

/// The message as a scene value; enums left unspecified and absent fields get the defaults the
/// .proto states. Numbers are only checked as far as the wire goes (shape, range of types, limits);
/// scene::validate does the rest.
/// @param prefix  path of the message, "scene." or empty
/// @throws Refusal or Error with a path below `prefix`
[[nodiscard]] DecodedScene decode_scene(const proto::Scene& message, const std::string& prefix,
                                        const SceneLimits& limits, const SceneReaders& readers);
/// The same; where `faults` collects, what could not be read has a default in its place. A mesh
/// that could not be read has no nodes, and what depends on it is not compared with it.
[[nodiscard]] DecodedScene decode_scene(const proto::Scene& message, const std::string& prefix,
                                        const SceneLimits& limits, const SceneReaders& readers,
                                        Faults& faults);

/// Decodes a mesh given as arrays. @throws Refusal
[[nodiscard]] bodies::TetMesh decode_mesh(const proto::MeshArrays& message,
                                          const std::string& field);
[[nodiscard]] proto::MeshArrays encode_mesh(const bodies::TetMesh& mesh);

/// Everything except the mesh, the base motion and poses of keyframes, which would be megabytes:
/// the caller sets `mesh` where it knows a short source.
[[nodiscard]] proto::Scene encode_scene(const scene::Scene& scene);
/// The base motion of a scene that has one, as positions.
[[nodiscard]] proto::BaseMotion encode_base_motion(const scene::Scene& scene);

/// Paths of the scene's fixed nodes, 3 fixed x frames [scene unit]; scene::pins_fault() checks
/// their numbers.
[[nodiscard]] Eigen::MatrixXd decode_pin_paths(const proto::Array& message,
                                               const std::string& field, const scene::Scene& scene);

/// @param field  path of the start, for errors
[[nodiscard]] std::shared_ptr<const scene::StartMotion> decode_start(const proto::Scene& message,
                                                                     const std::string& field);
/// The start motion of a scene that begins in this answer.
[[nodiscard]] proto::ModalMotion encode_start(const session::BodyResult& result);

[[nodiscard]] scene::Constraint decode_constraint(const proto::Constraint& message,
                                                  const std::string& field);
[[nodiscard]] scene::Constraint decode_constraint(const proto::Constraint& message,
                                                  const std::string& field, Faults& faults);
[[nodiscard]] proto::Constraint encode_constraint(const scene::Constraint& constraint);
[[nodiscard]] scene::End decode_end(proto::EndCondition end);
[[nodiscard]] proto::EndCondition encode_end(scene::End end);
[[nodiscard]] scene::MaterialVariables decode_variables(proto::MaterialVariables variables);
[[nodiscard]] proto::MaterialVariables encode_variables(scene::MaterialVariables variables);
[[nodiscard]] scene::DynamicsRequest decode_dynamics(const proto::Dynamics& message);
[[nodiscard]] proto::Dynamics encode_dynamics(const scene::Dynamics& dynamics);

/// Whether the scene has no field of another kind.
[[nodiscard]] bool is_body(const proto::Scene& message);
/// For what bodies alone can do.
/// @throws Refusal naming the field that makes the scene one of another kind
void demand_body(const proto::Scene& message, const std::string& prefix);
/// Takes out what a simulation does not look at: base motion, constraints and keyframes.
void leave_simulation(proto::Scene& message);

}  // namespace limber::server
