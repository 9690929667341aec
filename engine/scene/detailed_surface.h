#pragma once

#include <map>
#include <string>

#include "engine/scene/triangle_surface.h"

namespace limber::scene {

/// A detailed surface that follows a body: a plain value.
struct DetailedSurface {
  std::string name;     // of its file; the ending gives the format
  std::string content;  // the file byte for byte, with texture coordinates and materials
  std::map<std::string, std::string> companions;  // files that it names, by name
  TriangleSurface surface;  // vertices in the file's order [scene length unit]
};

}  // namespace limber::scene
