#include "server/wire/extension.h"

#include <fmt/format.h>

#include "server/wire/abbreviate.h"
#include "server/wire/scene_fields.h"

namespace limber::server {

void read_extension(const google::protobuf::Any& extension, const std::string& field,
                    google::protobuf::Message& message, WireBudget& budget) {
  const std::string& expected = message.GetDescriptor()->full_name();
  std::string given;
  if (!google::protobuf::Any::ParseAnyTypeUrl(extension.type_url(), &given) || given != expected) {
    throw invalid(field, fmt::format("a {} is expected, not '{}'", expected,
                                     abbreviate(extension.type_url(), 200)));
  }
  try {
    check_wire(extension.value(), *message.GetDescriptor(), budget);
  } catch (const Refusal& fault) {
    throw Refusal(fault.code(), fault.field().empty() ? field : field + "." + fault.field(),
                  fault.what(), fault.details());
  }
  if (!message.ParseFromString(extension.value()))
    throw malformed(fmt::format("{}: the bytes are not a {}", field, expected));
}

void demand_extension_alone(const proto::Scene& scene, const std::string& prefix) {
  if (const auto* field = field_beside(scene, {"name", "extension"}))
    throw invalid(prefix + field->name(),
                  "is of other scenes: one with an extension has a name beside it, nothing else");
}

google::protobuf::Any write_extension(const google::protobuf::Message& message) {
  google::protobuf::Any extension;
  extension.PackFrom(message);
  return extension;
}

}  // namespace limber::server
