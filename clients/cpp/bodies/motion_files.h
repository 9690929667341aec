#pragma once

#include <filesystem>

#include "limber/v1/scene.pb.h"

namespace limber::client {

/// Replaces paths in a base motion (.pc2, .pvd with the .vtu that it lists, or .vtu one by one) by
/// the bytes of the files. Paths are relative to `folder`; other sources stay unchanged. @throws
/// ClientError IO, INVALID_ARGUMENT naming the field
void put_motion_bytes(v1::BaseMotion& motion, const std::filesystem::path& folder);

}  // namespace limber::client
