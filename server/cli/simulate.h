#pragma once

#include <filesystem>

namespace limber::server {

/// Simulates a scene file and writes the motion and the scene that edits it; progress on stderr, a
/// summary on stdout.
/// @param output        .pc2 (with an .obj), .pvd or .vtu (both of them: a series); empty: none
/// @param scene_output  .json; empty: none
/// @returns the exit code @throws Error, Refusal
int simulate_file(const std::filesystem::path& input, const std::filesystem::path& output,
                  const std::filesystem::path& scene_output);

}  // namespace limber::server
