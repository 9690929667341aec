#include "clients/cli/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "clients/cli/beams/kind.h"
#include "clients/cli/bodies/kind.h"
#include "clients/cli/linkages/kind.h"

namespace limber::cli {
const Kind& kind_of(const v1::SessionStatus& status) {
  static const Kind kForeign;
  // Bodies last: a session of a server that does not name kinds may be of another one.
  static const Kind* const kKinds[] = {&linkages::kind(), &beams::kind(), &bodies::kind()};
  const auto* const found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                         [&](const Kind* kind) { return kind->is_of(status); });
  return found == std::end(kKinds) ? kForeign : **found;
}

std::string describe(const Kind& kind, const v1::ResultInfo& result) {
  if (result.solve_failed())
    return fmt::format("revision          {}\nstatus            failed, final\n{}\n",
                       result.revision(), result.message());
  return kind.describe(result);
}

}  // namespace limber::cli
