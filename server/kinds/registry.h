#pragma once

#include <functional>

#include "server/kinds/kind.h"

namespace limber::server {

/// The kinds of limberd: one row each, in the order in which they are asked for a scene.
[[nodiscard]] Kinds standard_kinds(const ServerOptions& options);

/// Of a program that has others: usually standard_kinds() and one more.
using MakeKinds = std::function<Kinds(const ServerOptions& options)>;

}  // namespace limber::server
