#pragma once

#include <functional>

#include "server/kinds/kind.h"

namespace limber::server {

/// The kinds of limberd: one row each, in the order in which they are tried for a scene.
[[nodiscard]] Kinds standard_kinds(const ServerOptions& options);

/// For a program with other kinds: usually standard_kinds() and one more.
using MakeKinds = std::function<Kinds(const ServerOptions& options)>;

}  // namespace limber::server
