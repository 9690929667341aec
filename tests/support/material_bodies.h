#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/session/bodies/model_cache.h"

namespace limber::testing {

/// A mesh of the public data in data/bodies, with the fixed nodes that go with it.
struct BodyFile {
  std::string name;
  std::filesystem::path mesh;         // in data/bodies
  std::filesystem::path fixed_nodes;  // a .bou file; empty: the lowest 5 % of the height are fixed
};

/// All of them, small ones first.
[[nodiscard]] const std::vector<BodyFile>& public_bodies();

/// Nodes of a .bou file: their count, then each.
[[nodiscard]] std::vector<int> read_node_list(const std::filesystem::path& path);

/// Nodes of the lowest 5 % of the height, of those that tets use.
[[nodiscard]] std::vector<int> lowest_nodes(const bodies::TetMesh& mesh);

/// So many nodes, each as far as can be from fixed ones and those before it.
[[nodiscard]] std::vector<int> far_nodes(const scene::Scene& scene, int count);

/// The body with default options and no targets; its own materials where it brings some.
/// @param bodies  the folder data/bodies
/// @returns nothing where the file is not there
[[nodiscard]] std::optional<scene::Scene> read_body(const BodyFile& file,
                                                    const std::filesystem::path& bodies);

/// What a body is to do.
enum class BodyTask {
  kConstraints,  // three nodes far from the fixed ones and each other, 0.1 to 0.3 body lengths away
  kLastEndFree,  // the same, the last end free
  kBothEndsFree,  // the same, both ends free
  kFreeBody,      // the same without fixed nodes
  kKeyframes,     // three poses of the motion that kConstraints takes with forces alone
};
[[nodiscard]] std::string name_of(BodyTask task);

/// Of a motion with all material variables beside the one with forces alone, which it starts from.
/// Steps are the largest distances of a node from one frame to the next [body lengths].
struct FittedMotion {
  int tets = 0;
  std::optional<double> high_frequency_share_forces, high_frequency_share;  // none: not determined
  double largest_step_forces = 0, largest_step = 0;
  int largest_step_frame = 0;  // the fitted motion makes it after this frame
  double energy_forces = 0, energy = 0;
  int published = 0;              // results after those of forces alone, the final one included
  int published_above_start = 0;  // of these, with a higher energy
  double shape_error = 0;         // MotionCheck, of the final result
  int inverted_tets = 0;          // the same
  std::string status, message;    // of the final result

  [[nodiscard]] double largest_step_ratio() const { return largest_step / largest_step_forces; }
};

/// A scene of default options in which this body has the task: 200 frames, 40 to a swing of the
/// lowest mode, targets in frames 50, 100 and 150. The same on every call.
/// @param scene  of its frames, ends and targets nothing is used
/// @param cache  of models
[[nodiscard]] scene::Scene with_task(scene::Scene scene, BodyTask task,
                                     const std::shared_ptr<session::ModelCache>& cache);

/// Opens the scene with all material variables.
/// @throws Error where the session cannot be opened or built
[[nodiscard]] FittedMotion fit_motion(scene::Scene scene,
                                      const std::shared_ptr<session::ModelCache>& cache);

}  // namespace limber::testing
