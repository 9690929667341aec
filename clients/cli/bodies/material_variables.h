#pragma once

#include <map>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::cli::bodies {

/// Values of `--optimise`.
inline const std::map<std::string, v1::MaterialVariables> kMaterialVariables = {
    {"motion", v1::MATERIAL_VARIABLES_MOTION},
    {"dynamics", v1::MATERIAL_VARIABLES_DYNAMICS},
    {"all", v1::MATERIAL_VARIABLES_ALL}};

}  // namespace limber::cli::bodies
