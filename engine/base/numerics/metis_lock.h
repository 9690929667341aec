#pragma once

#include <mutex>

namespace limber::detail {

/// METIS keeps its random state in a global of the process; one ordering at a time keeps them
/// reproducible.
[[nodiscard]] std::mutex& metis_mutex();

}  // namespace limber::detail
