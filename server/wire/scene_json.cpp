#include "server/wire/scene_json.h"

#include <google/protobuf/util/json_util.h>

#include "proto/json_text.h"
#include "server/wire/wire_check.h"

namespace limber::server {

proto::Scene scene_from_json(std::string_view text) {
  proto::Scene scene;
  if (const auto fault = json::read_scene(text, scene)) throw invalid(fault->field, fault->message);
  // JSON writes NaN as a string; what the wire refuses, a file may not bring in.
  check_wire(scene.SerializeAsString(), *proto::Scene::descriptor());
  return scene;
}

std::string scene_to_json(const proto::Scene& scene) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(scene, &text, options);
  LIMBER_DEMAND(status.ok());
  return text;
}

}  // namespace limber::server
