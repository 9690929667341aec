#include "bench/design_trace.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace limber::bench {

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

DesignTrace::DesignTrace(const rods::LinkageDesign& design,
                         const rods::DesignOptimizerOptions& options)
    : start_(thread_seconds()),
      joints_(design.model().variables().joints()),
      length_scale_(design.criteria().length_scale),
      target_flat_height_(options.flat_height),
      target_angle_(options.smallest_angle) {}

void DesignTrace::note(int iteration, const rods::DesignValues& values) {
  const double flat_room = 1 - std::pow(flat_height(values) / target_flat_height_, 2);
  const double angle_room = values.smallest_angle - target_angle_;
  const auto rank = rods::DesignRank::of(values.objective, std::min(flat_room, angle_room));
  if (bests_.empty() || rank.before(bests_.back().rank))
    bests_.push_back({seconds(), iteration, values, rank});
}

const DesignTrace::Best& DesignTrace::best_at(double seconds) const {
  const auto later = std::find_if(bests_.begin() + 1, bests_.end(),
                                  [&](const Best& best) { return best.seconds > seconds; });
  return *std::prev(later);
}

const DesignTrace::Best& DesignTrace::best_after(int iterations) const {
  const auto later = std::find_if(bests_.begin() + 1, bests_.end(),
                                  [&](const Best& best) { return best.iteration > iterations; });
  return *std::prev(later);
}

double DesignTrace::distance(const rods::DesignValues& values) const {
  return std::sqrt(2 * values.distance / joints_);
}

double DesignTrace::flat_height(const rods::DesignValues& values) const {
  return std::sqrt(values.flatness / joints_) / length_scale_;
}

}  // namespace limber::bench
