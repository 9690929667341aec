#include "bench/plain_pair.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "bench/cpu_time.h"

namespace limber::bench {
namespace {

constexpr double kShortestSample_s = 0.02;

/// One side of a pair with its measurements.
struct TimedSide {
  const std::function<double()>& run;
  double answer = 0;
  int calls = 1;
  std::vector<double> seconds = {};  // of a call, by round

  void warm_up() {
    const double once = cpu_seconds([&] { answer = run(); });
    calls = once >= kShortestSample_s
                ? 1
                : static_cast<int>(std::ceil(kShortestSample_s / std::max(once, 1e-7)));
  }
  void time_round() {
    const double all = cpu_seconds([&] {
      for (int i = 0; i < calls; ++i) answer = run();
    });
    seconds.push_back(all / calls);
  }
};

}  // namespace

Case measure_pair(const PlainPair& pair, int rounds) {
  TimedSide ours{pair.run_ours}, plain{pair.run_plain};
  ours.warm_up();
  plain.warm_up();
  const double difference = std::abs(ours.answer - plain.answer) / std::abs(plain.answer);
  if (!(difference <= pair.same)) {
    throw std::runtime_error(
        fmt::format("{}: the answers differ by {:.3g} (limit {:.3g}): {:.10g} and {:.10g}",
                    pair.name, difference, pair.same, ours.answer, plain.answer));
  }
  std::vector<double> ratios;
  for (int i = 0; i < rounds; ++i) {
    ours.time_round();
    plain.time_round();
    ratios.push_back(plain.seconds.back() / ours.seconds.back());
  }
  Case result;
  result["pair"] = pair.name;
  result["ratio"] = median(ratios);
  result["ratio_least"] = quantile(ratios, 0);
  result["ratio_most"] = quantile(ratios, 1);
  result["ours_cpu_ms"] = 1e3 * median(ours.seconds);
  result["plain_cpu_ms"] = 1e3 * median(plain.seconds);
  result["rounds"] = rounds;
  result["difference"] = difference;
  result["ours"] = pair.ours;
  result["plain"] = pair.plain;
  return result;
}

}  // namespace limber::bench
