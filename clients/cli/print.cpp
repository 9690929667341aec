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

std::string node_list(const v1::Constraint& constraint) {
  std::string text;
  for (int i = 0; i < constraint.nodes_size() && i < 4; ++i)
    text += fmt::format("{}{}", i > 0 ? "," : "", constraint.nodes(i));
  if (constraint.nodes_size() > 4) text += fmt::format(",... ({})", constraint.nodes_size());
  return text;
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

bool is_foreign(const v1::SessionStatus& status) {
  return !status.kind().empty() && status.kind() != "bodies" && status.kind() != "linkages" &&
         status.kind() != "beams";
}

std::string sizes(const v1::SessionStatus& status) {
  if (status.segments() > 0)
    return fmt::format("{} segments, {} joints", status.segments(), status.joints());
  if (status.beam_nodes() > 0)
    return fmt::format("{} elements, {} nodes", status.beam_elements(), status.beam_nodes());
  if (is_foreign(status)) return "of the kind " + status.kind();
  return fmt::format("{} tets, {} nodes, {} frames", status.tets(), status.nodes(),
                     status.frames());
}

namespace {

std::string describe_linkage(const v1::ResultInfo& result) {
  const auto& linkage = result.linkage();
  std::string text = fmt::format(
      "revision          {}\n"
      "status            {}{}\n"
      "iterations        {}\n"
      "energy            {:.6g} J  (stretching {:.4g} + bending {:.4g} + twisting {:.4g} + springs "
      "{:.4g} + loads {:.4g})\n"
      "mean angle        {:.3f} degrees, {} shapes\n"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), result.converged() ? ", final" : "",
      result.iterations(), result.total_energy(), linkage.stretching_energy(),
      linkage.bending_energy(), linkage.twisting_energy(), linkage.spring_energy(),
      linkage.load_potential(), linkage.mean_angle_degrees(), linkage.steps(),
      result.since_edit_ms());
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

/// Of an error.
std::string percent(double share) {
  if (share > 10) return "more than 1000 %";
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string describe(const v1::MotionError& error) {
  return fmt::format(
      "motion error      {} ({} in frame {}; tolerance {}), {:.3g} at most, "
      "constraints {:.3g} at most; of {} frames\n"
      "inverted tets     {}{}\n",
      percent(error.shape_error()), percent(error.worst_frame_error()), error.worst_frame(),
      percent(error.tolerance()), error.max_distance(), error.max_constraint_error(),
      error.frames(), error.inverted_tets(),
      error.inverted_tets() > 0 ? fmt::format(" in frame {}", error.inverted_frame()) : "");
}

/// Nothing at a minimum, and where nothing balances.
std::string inertia_words(const v1::BeamInfo& beams) {
  const auto negative = beams.negative_eigenvalues();
  if (negative == 0) return "";
  return fmt::format(" ({} negative eigenvalue{})", negative, negative == 1 ? "" : "s");
}

std::string describe_beams(const v1::ResultInfo& result) {
  const auto& beams = result.beams();
  const auto& energies = beams.energies();
  // 0 where no yield stress is known.
  const std::string utilisation =
      beams.largest_utilisation() > 0
          ? fmt::format("utilisation       {:.3g}\n", beams.largest_utilisation())
          : "";
  std::string text = fmt::format(
      "revision          {}\n"
      "status            {}{}{}\n"
      "steps             {} of loads, {} of Newton's, {} of the relaxation\n"
      "energy            {:.6g} J  (stretching {:.4g} + torsion {:.4g} + bending {:.4g})\n"
      "{}"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), inertia_words(beams),
      result.converged() ? ", final" : "", beams.load_steps(), beams.newton_iterations(),
      beams.relaxation_steps(), result.total_energy(), energies.stretching(), energies.torsion(),
      energies.bending_2() + energies.bending_3(), utilisation, result.since_edit_ms());
  for (const auto& snap : beams.snaps())
    text += fmt::format("snap              at {:.3f} of the way: node {} turns by {:.3g} rad\n",
                        snap.progress(), snap.node(), snap.turn());
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

}  // namespace

std::string describe(const v1::ResultInfo& result) {
  if (result.solve_failed())
    return fmt::format("revision          {}\nstatus            failed, final\n{}\n",
                       result.revision(), result.message());
  if (result.has_linkage()) return describe_linkage(result);
  if (result.has_beams()) return describe_beams(result);
  if (result.has_extension()) {
    return fmt::format(
        "revision          {}\n"
        "status            {}{}\n"
        "energy            {:.6g}\n"
        "since the edit    {:.2f} ms\n",
        result.revision(), status_words(result), result.converged() ? ", final" : "",
        result.total_energy(), result.since_edit_ms());
  }
  std::string text = fmt::format(
      "revision          {}\n"
      "status            {}{}\n"
      "iterations        {}\n"
      "energy            {:.6g}  (forces {:.6g} + constraints {:.6g})\n"
      "gradient          {:.3g}\n"
      "constraint error  {:.3g} at most, {:.3g} rms; of exact ones {:.3g} at most\n"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), result.converged() ? ", final" : "",
      result.iterations(), result.total_energy(), result.force_energy(), result.constraint_energy(),
      result.gradient(), result.max_constraint_error(), result.rms_constraint_error(),
      result.max_exact_error(), result.since_edit_ms());
  if (result.max_velocity_error() > 0)
    text += fmt::format("velocity error    {:.3g} a second at most; of exact ones {:.3g} at most\n",
                        result.max_velocity_error(), result.max_exact_velocity_error());
  if (result.material_iterations() > 0)
    text +=
        fmt::format("material          {} steps, control forces {:.6g} with modes of unit size\n",
                    result.material_iterations(), result.unit_force_energy());
  if (result.has_high_frequency_share())
    text += fmt::format(
        "high frequencies  {:.2g} of the motion's power above half the Nyquist frequency\n",
        result.high_frequency_share());
  if (result.max_keyframe_error() > 0)
    text += fmt::format("keyframe error    {:.3g} at most\n", result.max_keyframe_error());
  if (result.has_motion_error()) text += describe(result.motion_error());
  if (result.rank_deficient() && result.message().empty())
    text += "exact constraints contradict or repeat each other: a least-squares answer\n";
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

std::string motion_words(const v1::ResultInfo& result) {
  if (!result.has_motion_error()) return "";
  const auto& error = result.motion_error();
  return fmt::format(
      ", motion error {}{}", percent(error.shape_error()),
      error.inverted_tets() > 0 ? fmt::format(", {} tets inverted", error.inverted_tets()) : "");
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

std::vector<std::string> constraint_heading() {
  return {"id", "frame", "nodes", "axes", "kind", "target", "weight"};
}

std::vector<std::string> row(const v1::Constraint& constraint) {
  std::string axes;
  for (const auto axis : constraint.axes())
    axes += axis == v1::AXIS_X ? "x" : axis == v1::AXIS_Y ? "y" : axis == v1::AXIS_Z ? "z" : "?";
  const char* kind = constraint.has_position()   ? "position"
                     : constraint.has_velocity() ? "velocity"
                                                 : "displacement";
  const auto& target = constraint.has_position()   ? constraint.position()
                       : constraint.has_velocity() ? constraint.velocity()
                                                   : constraint.displacement();
  std::string weight = "100";
  if (constraint.enforcement_case() == v1::Constraint::kExact && constraint.exact())
    weight = "exact";
  if (constraint.enforcement_case() == v1::Constraint::kWeight)
    weight = fmt::format("{:g}", constraint.weight());
  return {std::to_string(constraint.id()),
          std::to_string(constraint.frame()),
          node_list(constraint),
          axes.empty() ? "xyz" : axes,
          kind,
          fmt::format("({:.5g}, {:.5g}, {:.5g})", target.x(), target.y(), target.z()),
          weight};
}

}  // namespace limber::cli
