#pragma once

#include <filesystem>
#include <optional>

#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

struct RecoverOptions {
  std::filesystem::path scene;
  std::filesystem::path output;               // .pc2 (with an .obj), .pvd or .vtu; empty: none
  proto::RecoverRequest request;              // but for the scene
  std::optional<int> modes, candidate_modes;  // in place of the scene's
  bool json = false;                          // the report as JSON in place of a table
};

/// Recovers the material of a scene file's base motion and writes the continued motion; progress on
/// stderr, a table of modes and the errors on stdout.
/// @returns the exit code @throws Error, Refusal
int recover_file(const RecoverOptions& options);

}  // namespace limber::server
