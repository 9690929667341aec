#pragma once

#include <google/protobuf/any.pb.h>

#include <string>

#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"
#include "server/wire/wire_check.h"

namespace limber::server {

/// Reads a message of a kind that limber.v1 does not know, and checks it as strictly as requests
/// are.
/// @param budget  shared by all extensions of a request: each may bring megabytes
/// @throws Refusal INVALID_ARGUMENT naming `field` for a message of another type, and its members
/// for errors of check_wire(); MALFORMED
void read_extension(const google::protobuf::Any& extension, const std::string& field,
                    google::protobuf::Message& message, WireBudget& budget);

/// A scene of such a kind has a name and the extension, nothing else.
/// @throws Refusal INVALID_ARGUMENT naming another field
void demand_extension_alone(const proto::Scene& scene, const std::string& prefix);

[[nodiscard]] google::protobuf::Any write_extension(const google::protobuf::Message& message);

}  // namespace limber::server
