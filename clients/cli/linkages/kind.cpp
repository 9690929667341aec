#include "clients/cli/linkages/kind.h"

#include <fmt/format.h>

#include "clients/cli/print.h"
#include "clients/cpp/linkages/plain_files.h"

namespace limber::cli::linkages {
namespace {

bool is_known(const v1::DiscretisationError& error) {
  return error.elements() > 0 && error.message().empty();
}

std::string describe_discretisation(const v1::DiscretisationError& error) {
  if (!is_known(error)) return fmt::format("edges             no estimate: {}\n", error.message());
  return fmt::format(
      "edges             {}: positions off by {:.2g} % of the size ({:.2g} m, next to joint {}{}), "
      "energy by {:.2g} %{}\n",
      error.elements(), 100 * error.position_error(), error.max_distance(), error.worst_node(),
      error.tolerance() > 0 ? fmt::format("; tolerance {:.2g} %", 100 * error.tolerance()) : "",
      100 * error.energy_error(),
      error.has_stress_error()
          ? fmt::format(", the largest stress of segment {} by {:.2g} % of all",
                        error.worst_stress_segment(), 100 * error.stress_error())
          : "");
}

class LinkageKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "linkages"; }
  [[nodiscard]] bool is_of(const v1::SessionStatus& status) const override {
    return Kind::is_of(status) || status.segments() > 0;
  }

  [[nodiscard]] std::string sizes(const v1::SessionStatus& status) const override {
    return fmt::format("{} segments, {} joints", status.segments(), status.joints());
  }
  [[nodiscard]] std::string describe(const v1::ResultInfo& result) const override;
  [[nodiscard]] std::string remark(const v1::ResultInfo& result) const override {
    const auto& error = result.discretisation_error();
    if (!is_known(error)) return "";
    return fmt::format(", positions off by {:.2g} %", 100 * error.position_error());
  }
  [[nodiscard]] std::string listed_conditions(const v1::SessionStatus& status) const override {
    return fmt::format("{} targets", status.targets());
  }
  [[nodiscard]] std::string listed_angle(const v1::SessionStatus& status) const override {
    if (!status.result().has_linkage()) return "-";
    return fmt::format("{:.2f}", status.result().linkage().mean_angle_degrees());
  }
  [[nodiscard]] std::string energy_unit() const override { return "J"; }
  [[nodiscard]] std::string watched_heading() const override { return "mean angle [deg]"; }
  [[nodiscard]] std::string watched_value(const v1::ResultInfo& result) const override {
    return fmt::format("{:.5g}", result.linkage().mean_angle_degrees());
  }
  [[nodiscard]] bool has_energy_of_iterates() const override { return false; }
  [[nodiscard]] std::string assumptions(const v1::Scene& scene) const override {
    return client::linkage_assumptions(scene);
  }

 protected:
  [[nodiscard]] std::string contents(const v1::GetSessionResponse& session) const override {
    return fmt::format("{}, {} targets", sizes(session.status()), session.status().targets());
  }
};

std::string LinkageKind::describe(const v1::ResultInfo& result) const {
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
  if (result.has_discretisation_error())
    text += describe_discretisation(result.discretisation_error());
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

}  // namespace

const Kind& kind() {
  static const LinkageKind kKind;
  return kKind;
}

}  // namespace limber::cli::linkages
