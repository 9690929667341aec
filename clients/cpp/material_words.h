#pragma once

#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// "Young's modulus 1e+06 Pa, .., 1 unit = 1 m".
[[nodiscard]] std::string material_words(const v1::Material& material,
                                         double length_unit_in_metres);

}  // namespace limber::client
