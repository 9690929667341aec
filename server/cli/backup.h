#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace limber::server {

/// `limberd backup FOLDER FILE`: a copy of a store, while a server may have it.
/// @param chosen  gets what the command does, where it is given
void add_backup_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace limber::server
