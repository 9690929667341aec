#pragma once

#include <functional>

namespace limber::session {

/// Runs a task later on some thread. A session posts at most one task at a
/// time, and those of bodies and linkages one that checks final results besides, then those
/// of bodies one that compares numbers of modes.
using Executor = std::function<void(std::function<void()>)>;

}  // namespace limber::session
