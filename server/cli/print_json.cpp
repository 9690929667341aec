#include "server/cli/print_json.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <string>

#include "engine/base/error.h"

namespace limber::server {

void print_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  LIMBER_DEMAND(status.ok());
  fmt::print("{}\n", text);
}

}  // namespace limber::server
