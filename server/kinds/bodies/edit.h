#pragma once

#include <vector>

#include "engine/session/bodies/edit.h"
#include "limber/v1/service.pb.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/errors.h"

namespace limber::server {

/// @param scene  scene with the mesh, fixed nodes and frames of poses and pins; load_mesh as
/// decode_keyframe()
/// @throws Refusal with fields "edits[i].add.constraint...."
[[nodiscard]] std::vector<session::BodyEdit> decode_edits(const proto::EditRequest& request,
                                                          const scene::Scene& scene,
                                                          const MeshLoader& load_mesh);
[[nodiscard]] proto::EditResponse encode_receipt(const session::EditReceipt& receipt);

}  // namespace limber::server
