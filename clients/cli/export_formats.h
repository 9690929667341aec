#pragma once

#include <map>
#include <string>

#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Values of `limber export --format`.
inline const std::map<std::string, v1::ExportFormat> kExportFormats = {
    {"pvd", v1::EXPORT_FORMAT_PVD},         {"pc2", v1::EXPORT_FORMAT_PC2},
    {"vtp", v1::EXPORT_FORMAT_VTP},         {"obj", v1::EXPORT_FORMAT_OBJ},
    {"json", v1::EXPORT_FORMAT_JSON},       {"scene", v1::EXPORT_FORMAT_SCENE},
    {"vtu", v1::EXPORT_FORMAT_VTU},         {"csv", v1::EXPORT_FORMAT_CSV},
    {"blender", v1::EXPORT_FORMAT_BLENDER}, {"surface", v1::EXPORT_FORMAT_SURFACE}};

}  // namespace limber::cli
