#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "limber/v1/service.pb.h"

namespace limber::server {

/// How long a session took to its final results, from the newest edit in each. Not thread-safe.
class SolveTimes {
 public:
  /// A result of the session: counts where it is the first final one of its revision.
  void note(const limber::v1::ResultInfo& result) {
    if (!result.converged() || revision_ == result.revision()) return;
    revision_ = result.revision();
    ++solves_;
    newest_s_ = result.since_edit_ms() * 1e-3;
    longest_s_ = std::max(longest_s_, newest_s_);
  }
  void describe(limber::v1::SessionUse& use) const {
    use.set_solves(solves_);
    use.set_newest_solve_s(newest_s_);
    use.set_longest_solve_s(longest_s_);
  }

 private:
  std::optional<std::uint64_t> revision_;
  std::uint64_t solves_ = 0;
  double newest_s_ = 0, longest_s_ = 0;
};

}  // namespace limber::server
