#pragma once

#include <string>

namespace limber::server {

/// A bar on a terminal, one line per stage elsewhere.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(const std::string& stage, double fraction);

 private:
  const bool terminal_;
  bool drawn_ = false;
  std::string stage_;
};

}  // namespace limber::server
