#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/engine/session/contract/beam_kind.h"
#include "tests/engine/session/contract/body_kind.h"
#include "tests/engine/session/contract/linkage_kind.h"
#include "tests/engine/session/contract/spring_kind.h"

// The kinds of sessions that the contract tests run over. A new kind adds an adapter, a struct with
// the same members, and its name here.

namespace limber::session::contract {

using Kinds = ::testing::Types<BodyKind, LinkageKind, BeamKind, SpringKind>;

/// Names of typed tests.
struct KindNames {
  template <class Kind>
  static std::string GetName(int) {
    return Kind::kName;
  }
};

}  // namespace limber::session::contract
