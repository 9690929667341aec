#pragma once

#include <string>
#include <vector>

namespace limber::cli {

/// Becomes limberd with these arguments, under the name of limber. For commands that need the
/// engine, or files of the server, which clients do not link. Does not return.
/// @throws ClientError NOT_FOUND
[[noreturn]] void become_limberd(std::vector<std::string> arguments);

}  // namespace limber::cli
