#pragma once

#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Rows of text in aligned columns; the first row is the heading. Columns whose cells are numbers
/// are right-aligned.
class Table {
 public:
  explicit Table(std::vector<std::string> heading) : rows_{std::move(heading)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Long work on stderr: a bar where that is a terminal, else a plain line whenever the stage or the
/// tenth changes.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(const std::string& stage, double fraction);
  /// For work that does not report its progress.
  void show(const std::string& stage);

 private:
  void draw(const std::string& line);

  bool terminal_;
  std::size_t length_ = 0;
  std::string shown_;
};

/// A state or status in lower case: "ready" for SESSION_STATE_READY.
[[nodiscard]] std::string words(const std::string& enumerator, const std::string& prefix);
/// "1 change", "3 changes".
[[nodiscard]] std::string counted(std::uint64_t count, const std::string& noun);
/// "view", "edit" or "administer".
[[nodiscard]] std::string role_words(v1::Role role);
/// Also where a session that is ready has found no solution.
[[nodiscard]] std::string state_words(const v1::SessionStatus& status);
/// How a solve ended: "converged", "stalled", "failed" where there is no solution at all.
[[nodiscard]] std::string status_words(const v1::ResultInfo& result);

/// A solve that found no solution: the reason on stderr, and exit code kRefused.
void note_failure(Context& context, const v1::ResultInfo& result);

/// "robot (robot arm)", or the session alone where the scene has no name.
[[nodiscard]] std::string title(const v1::SessionStatus& status);

/// Sizes and errors of a model, on one line.
[[nodiscard]] std::string describe(const v1::ModelInfo& model);
/// End of a wait: "first", "final" or "checked".
[[nodiscard]] v1::WaitRequest::Until wait_until(const std::string& word);
/// "warning: mesh.tets[7]: ..."
[[nodiscard]] std::string describe(const v1::Issue& issue);

}  // namespace limber::cli
