#pragma once

#include "bench/suite.h"

namespace limber::bench {

/// Machine properties that figures depend on: `cpu` (model), `cores` (that this process may use),
/// `simd` (level the program is compiled for), `compiler`, `build_type`.
[[nodiscard]] Case describe_machine();

/// Mean number of processes that wanted a core during the last minute; null where the system does
/// not tell.
[[nodiscard]] Case load_average();

/// `git describe` of the sources that the program was built of, with "-dirty" where they have
/// changed; "unknown" without git.
[[nodiscard]] std::string source_commit();

/// Folder of those sources.
[[nodiscard]] std::string source_folder();

}  // namespace limber::bench
