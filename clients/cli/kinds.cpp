#include "clients/cli/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "clients/cli/beams/kind.h"
#include "clients/cli/bodies/kind.h"
#include "clients/cli/linkages/kind.h"

namespace limber::cli {
namespace {

/// The kind that a message is of.
template <class Message>
const Kind& find_kind(const Message& message) {
  static const Kind kForeign;
  // Bodies last: what is said of them has no part of its own in limber.v1.
  static const Kind* const kKinds[] = {&linkages::kind(), &beams::kind(), &bodies::kind()};
  const auto* const found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                         [&](const Kind* kind) { return kind->is_of(message); });
  return found == std::end(kKinds) ? kForeign : **found;
}

}  // namespace

const Kind& kind_of(const v1::SessionStatus& status) { return find_kind(status); }
const Kind& kind_of(const v1::ResultInfo& result) { return find_kind(result); }

std::string describe(const v1::ResultInfo& result) {
  if (result.solve_failed())
    return fmt::format("revision          {}\nstatus            failed, final\n{}\n",
                       result.revision(), result.message());
  return kind_of(result).describe(result);
}

}  // namespace limber::cli
