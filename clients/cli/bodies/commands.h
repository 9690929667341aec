#pragma once

#include "clients/cli/context.h"

namespace limber::cli::bodies {

/// cold, add, move, replace, remove, ends, dynamics, material.
void add_edit_commands(CLI::App& app, Context& context);
/// keyframe, keyframes.
void add_keyframe_commands(CLI::App& app, Context& context);

}  // namespace limber::cli::bodies
