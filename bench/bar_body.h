#pragma once

#include "engine/bodies/elastic_body.h"

namespace limber::bench {

/// A bar of 3 x 1 x 1 m of one material, held at one end: cubes of six tets around a diagonal.
/// @param cells  along the shorter sides, >= 1: 18 cells^3 tets
[[nodiscard]] bodies::ElasticBody bar_body(int cells);

}  // namespace limber::bench
