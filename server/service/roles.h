#pragma once

#include <optional>
#include <string>

#include "limber/v1/access.pb.h"
#include "server/transport/role.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The table of roles: the lowest role for each request. A request without a row does not compile.
/// @param body  Request::BodyCase, or any other number that a client may send: nothing
[[nodiscard]] std::optional<Role> least_role(int body);

/// @throws Refusal PERMISSION_DENIED with details {needs, has}
/// @param body  as of least_role(); of none that is known nothing is demanded: it is refused as
/// such
void demand_role(Role has, int body);
/// The same of something that is named otherwise, e.g. "to stop the server".
void demand_role(Role has, Role needed, const std::string& field, const std::string& what);

[[nodiscard]] proto::Role to_proto(Role role);
/// Nothing for ROLE_UNSPECIFIED.
[[nodiscard]] std::optional<Role> from_proto(proto::Role role);

}  // namespace limber::server
