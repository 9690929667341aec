#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace limber::server {

/// allow, revoke, allowed: the list of keys as a file, where no server runs.
/// @param chosen  set to the command that is given; it returns the exit code
void add_access_commands(CLI::App& app, std::function<int()>& chosen);

}  // namespace limber::server
