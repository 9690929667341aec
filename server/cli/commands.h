#pragma once

namespace limber::server {

/// limberd: parses the command line and runs the server or one of the commands that need none.
/// @returns the exit code: 0 success, 1 what was asked for cannot be done, 2 a wrong command line
int run(int argc, char** argv);

}  // namespace limber::server
