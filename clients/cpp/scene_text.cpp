#include "clients/cpp/scene_text.h"

#include "clients/cpp/error.h"
#include "proto/json_text.h"

namespace limber::client {

v1::Scene parse_scene(const std::string& text, const std::filesystem::path& path) {
  v1::Scene scene;
  if (const auto fault = json::read_scene(text, scene))
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT,
                      fault->field.empty() ? "scene" : "scene." + fault->field,
                      path.string() + " is no scene: " + fault->message);
  return scene;
}

}  // namespace limber::client
