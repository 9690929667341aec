#include "clients/cli/print.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace limber::cli {
namespace {

bool looks_like_a_number(const std::string& cell) {
  return cell.empty() || cell == "-" || std::isdigit(static_cast<unsigned char>(cell[0])) != 0 ||
         (cell.size() > 1 && cell[0] == '-' &&
          std::isdigit(static_cast<unsigned char>(cell[1])) != 0);
}

}  // namespace

std::string Table::text() const {
  const std::size_t columns = rows_.front().size();
  std::string text;
  std::vector<std::size_t> width(columns, 0);
  std::vector<bool> right(columns, rows_.size() > 1);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      width[c] = std::max(width[c], rows_[r][c].size());
      if (r > 0 && !looks_like_a_number(rows_[r][c])) right[c] = false;
    }
  }
  for (const auto& cells : rows_) {
    std::string line;
    for (std::size_t c = 0; c < columns; ++c) {
      line += right[c] ? fmt::format("{:>{}}", cells[c], width[c])
                       : fmt::format("{:<{}}", cells[c], width[c]);
      line += "  ";
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

ProgressBar::ProgressBar() : terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (length_ > 0) fmt::print(stderr, "\n");
}

void ProgressBar::show(const std::string& stage, double fraction) {
  fraction = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  if (!terminal_) return draw(fmt::format("{}: {} %", stage, 10 * static_cast<int>(fraction * 10)));
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(std::lround(kWidth * fraction));
  draw(fmt::format("{:<28.28} [{:#<{}}{:.<{}}] {:3.0f} %", stage, "", filled, "", kWidth - filled,
                   100 * fraction));
}

void ProgressBar::show(const std::string& stage) { draw(stage); }

void ProgressBar::draw(const std::string& line) {
  if (terminal_) {
    fmt::print(stderr, "\r{:<{}}", line, length_);
    std::fflush(stderr);
    length_ = line.size();
  } else if (line != shown_) {
    fmt::print(stderr, "{}\n", line);
  }
  shown_ = line;
}

std::string words(const std::string& enumerator, const std::string& prefix) {
  std::string text = enumerator.starts_with(prefix) ? enumerator.substr(prefix.size()) : enumerator;
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return c == '_' ? ' ' : static_cast<char>(std::tolower(c));
  });
  return text;
}

std::string counted(std::uint64_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string role_words(v1::Role role) { return words(v1::Role_Name(role), "ROLE_"); }

std::string state_words(const v1::SessionStatus& status) {
  const std::string state = words(v1::SessionState_Name(status.state()), "SESSION_STATE_");
  return status.result().solve_failed() ? state + ", no solution" : state;
}

std::string status_words(const v1::ResultInfo& result) {
  if (result.solve_failed()) return "failed";
  return words(v1::SolveStatus_Name(result.status()), "SOLVE_STATUS_");
}

void note_failure(Context& context, const v1::ResultInfo& result) {
  if (!result.solve_failed()) return;
  context.exit_code = kRefused;
  fmt::print(stderr, "limber: revision {} has no solution: {}\n", result.revision(),
             result.message());
}

std::string title(const v1::SessionStatus& status) {
  if (status.name().empty()) return status.session();
  return fmt::format("{} ({})", status.session(), status.name());
}

std::string describe(const v1::ModelInfo& model) {
  return fmt::format(
      "{} modes, {} basis columns ({}), {} cubature tets, error {:.2g} mean {:.2g} max{}",
      model.modes(), model.basis_size(), words(v1::Basis_Name(model.basis()), "BASIS_"),
      model.cubature_size(), model.error_mean(), model.error_max(),
      model.met_tolerance() ? "" : ", tolerance NOT met");
}

v1::WaitRequest::Until wait_until(const std::string& word) {
  if (word == "first") return v1::WaitRequest::UNTIL_FIRST;
  return word == "checked" ? v1::WaitRequest::UNTIL_CHECKED : v1::WaitRequest::UNTIL_FINAL;
}

std::string describe(const v1::Issue& issue) {
  const char* kind = issue.severity() == v1::Issue::SEVERITY_ERROR ? "error" : "warning";
  if (issue.field().empty()) return fmt::format("{}: {}", kind, issue.message());
  return fmt::format("{}: {}: {}", kind, issue.field(), issue.message());
}

}  // namespace limber::cli
