#pragma once

#include <filesystem>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// Puts the bytes of a rod linkage's file of lines in place of its path, relative to `folder`.
/// @throws ClientError IO naming the field
void put_linkage_bytes(v1::Scene& scene, const std::filesystem::path& folder);

}  // namespace limber::client
