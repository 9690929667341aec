#include "engine/base/numerics/line_search.h"

#include <fmt/format.h>

#include "engine/base/error.h"

namespace limber {
namespace {

template <class T>
void require(bool holds, const char* member, T value, const char* inequality) {
  if (holds) return;
  throw Error(ErrorCode::kInvalidArgument, member,
              fmt::format("{} = {}, must be {}", member, value, inequality));
}

}  // namespace

void BacktrackOptions::validate() const {
  require(shortest_step >= 0, "shortest_step", shortest_step, ">= 0");
  require(max_trials > 0, "max_trials", max_trials, "> 0");
}

void ExpandOptions::validate() const {
  require(first_step > 0, "first_step", first_step, "> 0");
  require(std::isfinite(longest_step), "longest_step", longest_step, "finite");
  require(!(rounding < 0), "rounding", rounding, ">= 0");
}

}  // namespace limber
