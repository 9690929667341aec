#pragma once

#include "clients/cli/context.h"
#include "clients/cli/load_command.h"

namespace limber::cli::linkages {

/// deploy, pin, attach.
void add_edit_commands(CLI::App& app, Context& context);
/// design.
void add_design_commands(CLI::App& app, Context& context);
/// `limber load --joint`.
[[nodiscard]] v1::EditResponse load_joint(Context& context, const LoadOptions& options);

}  // namespace limber::cli::linkages
