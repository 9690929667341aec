#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/formats/mesh_formats.h"

namespace limber::scene {

/// Gives the tets of a mesh just read the materials of an `.elastic` file: groups of (E, nu),
/// density and tet ids.
///
/// Ids count from 0 or 1, which the data decide. An id 0 means from 0, an id equal to the number of
/// tets means from 1, both is an error. Neither means from 0 (as in the known files, contrary to
/// their notes). A group without a list is for all tets that no list names. The remaining tets get
/// Material{}, with a warning.
/// @throws Error{kInvalidArgument} with `name` as field and "name:line: ..." as message
void read_materials(const std::string& name, std::string_view content, MeshReading& reading);

/// Reads a `.bou` list of fixed nodes: a count, then that many node ids counted from 0.
/// @returns ids, sorted and unique.
/// @throws Error{kInvalidArgument} for a wrong count or an id outside of [0, node_count).
[[nodiscard]] std::vector<int> read_fixed_nodes(const std::string& name, std::string_view content,
                                                int node_count);

}  // namespace limber::scene
