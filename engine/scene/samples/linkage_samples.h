#pragma once

#include <string>
#include <vector>

#include "engine/scene/linkage.h"

namespace limber::scene {

/// Names of the linkages that limber can make by itself.
[[nodiscard]] const std::vector<std::string>& linkage_sample_names();

/// A complete linkage [m]. The same bits on every call.
///
/// - grid: two families of 9 straight rods, flat, drawn at 20 degrees; opens in its plane without
///   effort
/// - hyperboloid: 12 and 12 straight rods along the rulings of a hyperboloid of revolution, at a
///   mean angle of 20 degrees at first
/// - dome: a flat grid whose cells are longer in the middle: it has to leave the plane to open
/// @throws Error{kNotFound} listing the names there are
[[nodiscard]] Linkage make_linkage_sample(const std::string& name);

}  // namespace limber::scene
