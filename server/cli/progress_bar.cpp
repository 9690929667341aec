#include "server/cli/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace limber::server {

ProgressBar::ProgressBar() : terminal_(::isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && drawn_) fmt::print(stderr, "\n");
}

void ProgressBar::show(const std::string& stage, double fraction) {
  constexpr int kWidth = 40;
  if (!terminal_) {
    if (stage != stage_) fmt::print(stderr, "{}\n", stage);
    stage_ = stage;
    return;
  }
  const int filled = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
  fmt::print(stderr, "\r[{:<{}}] {:3.0f} %  {:<32.32}",
             std::string(static_cast<std::size_t>(filled), '#'), kWidth, 100 * fraction, stage);
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace limber::server
