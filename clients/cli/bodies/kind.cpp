#include "clients/cli/bodies/kind.h"

#include <fmt/format.h>

#include <vector>

#include "clients/cli/print.h"
#include "clients/cpp/bodies/plain_files.h"

namespace limber::cli::bodies {
namespace {

class BodyKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "bodies"; }
  /// Also of a server that does not name kinds.
  [[nodiscard]] bool is_of(const v1::SessionStatus& status) const override {
    return Kind::is_of(status) || status.kind().empty();
  }

  [[nodiscard]] std::string sizes(const v1::SessionStatus& status) const override {
    return fmt::format("{} tets, {} nodes, {} frames", status.tets(), status.nodes(),
                       status.frames());
  }
  [[nodiscard]] std::string describe(const v1::ResultInfo& result) const override;
  [[nodiscard]] std::string remark(const v1::ResultInfo& result) const override;
  [[nodiscard]] std::string summary(const v1::GetSessionResponse& session) const override;
  [[nodiscard]] std::string conditions(const v1::GetSessionResponse& session) const override;
  [[nodiscard]] std::string listed_sizes(const v1::SessionStatus& status) const override {
    return fmt::format("{} tets, {} frames", status.tets(), status.frames());
  }
  [[nodiscard]] std::string listed_conditions(const v1::SessionStatus& status) const override {
    return fmt::format("{} constraints", status.constraints());
  }
  [[nodiscard]] std::string watched_heading() const override { return "error"; }
  [[nodiscard]] std::string watched_value(const v1::ResultInfo& result) const override {
    return fmt::format("{:.5g}", result.max_constraint_error());
  }
  [[nodiscard]] std::string assumptions(const v1::Scene& scene) const override {
    return client::body_assumptions(scene);
  }

 protected:
  [[nodiscard]] std::string contents(const v1::GetSessionResponse& session) const override {
    const auto& status = session.status();
    return fmt::format("{} nodes, {} tets, {} frames, {} constraints", status.nodes(),
                       status.tets(), status.frames(), status.constraints());
  }
};

/// Text of an error.
std::string percent(double share) {
  if (share > 10) return "more than 1000 %";
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string describe_error(const v1::MotionError& error) {
  return fmt::format(
      "motion error      {} ({} in frame {}; tolerance {}), {:.3g} at most, "
      "constraints {:.3g} at most; of {} frames\n"
      "inverted tets     {}{}\n"
      "zigzag            {:.2g} body lengths in frame {}\n",
      percent(error.shape_error()), percent(error.worst_frame_error()), error.worst_frame(),
      percent(error.tolerance()), error.max_distance(), error.max_constraint_error(),
      error.frames(), error.inverted_tets(),
      error.inverted_tets() > 0 ? fmt::format(" in frame {}", error.inverted_frame()) : "",
      error.zigzag_share(), error.zigzag_frame());
}

std::string BodyKind::describe(const v1::ResultInfo& result) const {
  std::string text = fmt::format(
      "revision          {}\n"
      "status            {}{}\n"
      "iterations        {}\n"
      "energy            {:.6g}  (forces {:.6g} + constraints {:.6g}), {}\n"
      "gradient          {:.3g}\n"
      "constraint error  {:.3g} at most, {:.3g} rms; of exact ones {:.3g} at most\n"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), result.converged() ? ", final" : "",
      result.iterations(), result.total_energy(), result.force_energy(), result.constraint_energy(),
      result.exact()           ? "exact"
      : result.first_picture() ? "of the first picture's coarse model"
                               : "of the reduced model",
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
  if (result.has_motion_error()) text += describe_error(result.motion_error());
  if (result.rank_deficient() && result.message().empty())
    text += "exact constraints contradict or repeat each other: a least-squares answer\n";
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

std::string BodyKind::remark(const v1::ResultInfo& result) const {
  if (!result.has_motion_error()) return "";
  const auto& error = result.motion_error();
  return fmt::format(
      ", motion error {}{}", percent(error.shape_error()),
      error.inverted_tets() > 0 ? fmt::format(", {} tets inverted", error.inverted_tets()) : "");
}

std::string BodyKind::summary(const v1::GetSessionResponse& session) const {
  const auto& status = session.status();
  std::string text = Kind::summary(session);
  if (status.state() == v1::SESSION_STATE_BUILDING)
    text += fmt::format("{}: {:.0f} %\n",
                        status.progress().stage().empty() ? "building" : status.progress().stage(),
                        100 * status.progress().fraction());
  if (status.has_model()) text += fmt::format("model: {}\n", cli::describe(status.model()));
  return text +
         fmt::format("ends: {} / {}\n",
                     words(v1::EndCondition_Name(session.scene().first_end()), "END_CONDITION_"),
                     words(v1::EndCondition_Name(session.scene().last_end()), "END_CONDITION_"));
}

/// Its held place: nodes, or "triangle 7 (0.5, 0.25, 0.25)", or "vertex 12" of a surface.
std::string node_list(const v1::Constraint& constraint) {
  if (constraint.has_surface_vertex()) return fmt::format("vertex {}", constraint.surface_vertex());
  if (constraint.has_point()) {
    const auto& weights = constraint.point().weights();
    return fmt::format("triangle {} ({:.3g})", constraint.point().triangle(),
                       fmt::join(weights.begin(), weights.end(), ", "));
  }
  std::string text;
  for (int i = 0; i < constraint.nodes_size() && i < 4; ++i)
    text += fmt::format("{}{}", i > 0 ? "," : "", constraint.nodes(i));
  if (constraint.nodes_size() > 4) text += fmt::format(",... ({})", constraint.nodes_size());
  return text;
}

/// "12", of a path "12-40"; with its reach "12 within 0.5 s".
std::string frames_of(const v1::Constraint& constraint) {
  std::string text = std::to_string(constraint.frame());
  if (!constraint.path().empty())
    text += fmt::format("-{}", constraint.path(constraint.path_size() - 1).frame());
  if (constraint.has_reach()) text += fmt::format(" within {:g} s", constraint.reach());
  return text;
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
          frames_of(constraint),
          node_list(constraint),
          axes.empty() ? "xyz" : axes,
          kind,
          fmt::format("({:.5g}, {:.5g}, {:.5g})", target.x(), target.y(), target.z()),
          weight};
}

std::string BodyKind::conditions(const v1::GetSessionResponse& session) const {
  if (session.scene().constraints().empty()) return "";
  Table table({"id", "frame", "holds", "axes", "kind", "target", "weight"});
  for (const auto& constraint : session.scene().constraints()) table.add(row(constraint));
  return table.text();
}

}  // namespace

const Kind& kind() {
  static const BodyKind kKind;
  return kKind;
}

}  // namespace limber::cli::bodies
