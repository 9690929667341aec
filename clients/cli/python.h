#pragma once

#include <string>
#include <vector>

#include "clients/cli/context.h"

namespace limber::cli {

/// For commands that the Python client carries out. @throws ClientError UNSUPPORTED naming
/// `key_file` where the context has CURVE keys, which those do not take
void demand_no_keys(const Context& context, const std::string& command);

/// Becomes `python3 -m limber COMMAND ARGUMENTS` with the context's endpoint. The Python client in
/// the sources that this program was built of comes before an installed one. The interpreter is the
/// one that LIMBER_PYTHON names, if any.
/// @throws ClientError NOT_FOUND naming LIMBER_PYTHON where there is none
[[noreturn]] void run_python(const Context& context, const std::string& command,
                             std::vector<std::string> arguments);

}  // namespace limber::cli
