#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace limber::server {

/// What a client may do. Each may do what those before it may.
enum class Role : std::uint8_t {
  kView,        // list, look, follow streams, export results
  kEdit,        // open, edit, restore and close sessions; begin and cancel jobs
  kAdminister,  // stop the server, assign roles
};

/// As in files, on command lines and in errors: "view", "edit", "administer".
[[nodiscard]] const char* name_of(Role role);

/// Nothing for any other word.
[[nodiscard]] std::optional<Role> role_of(std::string_view name);

}  // namespace limber::server
