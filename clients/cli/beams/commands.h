#pragma once

#include "clients/cli/context.h"
#include "clients/cli/load_command.h"

namespace limber::cli::beams {

/// beams.
void add_solve_command(CLI::App& app, Context& context);
/// support, bring, release, hold, push.
void add_edit_commands(CLI::App& app, Context& context);
/// `limber load --node` and `--element`.
[[nodiscard]] v1::EditResponse load_node(Context& context, const LoadOptions& options);
[[nodiscard]] v1::EditResponse load_element(Context& context, const LoadOptions& options);

}  // namespace limber::cli::beams
