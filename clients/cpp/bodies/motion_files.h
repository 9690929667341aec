#pragma once

#include <filesystem>

#include "limber/v1/scene.pb.h"

namespace limber::client {

/// Puts the bytes of the files that a base motion names (.pc2, .pvd with the .vtu that it lists, or
/// .vtu one by one) in place of their paths, which are relative to `folder`; others stay as they
/// are. @throws ClientError IO, INVALID_ARGUMENT naming the field
void put_motion_bytes(v1::BaseMotion& motion, const std::filesystem::path& folder);

}  // namespace limber::client
