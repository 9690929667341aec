#include "server/transport/role.h"

namespace limber::server {

const char* name_of(Role role) {
  switch (role) {
    case Role::kView:
      return "view";
    case Role::kEdit:
      return "edit";
    case Role::kAdminister:
      return "administer";
  }
  return "";
}

std::optional<Role> role_of(std::string_view name) {
  for (const Role role : {Role::kView, Role::kEdit, Role::kAdminister}) {
    if (name == name_of(role)) return role;
  }
  return std::nullopt;
}

}  // namespace limber::server
