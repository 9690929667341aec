#pragma once

#include "server/kinds/registry.h"

namespace limber::server {

/// limberd: parses the command line and runs the server or one of the commands that need none.
/// @returns the exit code: 0 success, 1 the request failed, 2 a wrong command line
/// @param make_kinds  the kinds of sessions that it has
int run(int argc, char** argv, const MakeKinds& make_kinds = standard_kinds);

}  // namespace limber::server
