#include "clients/cli/beams/kind.h"

#include <fmt/format.h>

#include "clients/cli/beams/words.h"
#include "clients/cli/print.h"

namespace limber::cli::beams {
namespace {

class BeamKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "beams"; }
  [[nodiscard]] bool is_of(const v1::SessionStatus& status) const override {
    return Kind::is_of(status) || status.beam_nodes() > 0;
  }

  [[nodiscard]] std::string sizes(const v1::SessionStatus& status) const override {
    return fmt::format("{} elements, {} nodes", status.beam_elements(), status.beam_nodes());
  }
  [[nodiscard]] std::string describe(const v1::ResultInfo& result) const override;
  [[nodiscard]] std::string remark(const v1::ResultInfo& result) const override;
  [[nodiscard]] std::string energy_unit() const override { return "J"; }
  [[nodiscard]] bool has_energy_of_iterates() const override { return false; }

 protected:
  /// Supports and loads of the structure.
  [[nodiscard]] std::string contents(const v1::GetSessionResponse& session) const override {
    const auto& structure = session.scene().beams().structure();
    return fmt::format("{}, {} supports, {} motions, {} loads", sizes(session.status()),
                       structure.supports_size(), structure.motions_size(),
                       structure.loads_size() + structure.distributed_loads_size());
  }
};

std::string BeamKind::describe(const v1::ResultInfo& result) const {
  const auto& beams = result.beams();
  const auto& energies = beams.energies();
  // 0 where no yield stress is known.
  const std::string utilisation =
      beams.largest_utilisation() > 0
          ? fmt::format("utilisation       {:.3g}{}\n", beams.largest_utilisation(),
                        overload_words(beams.largest_utilisation()))
          : "";
  std::string text = fmt::format(
      "revision          {}\n"
      "status            {}{}{}\n"
      "steps             {} of loads, {} of Newton's, {} of the relaxation\n"
      "energy            {:.6g} J  (stretching {:.4g} + torsion {:.4g} + bending {:.4g})\n"
      "{}"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), inertia_words(beams.negative_eigenvalues()),
      result.converged() ? ", final" : "", beams.load_steps(), beams.newton_iterations(),
      beams.relaxation_steps(), result.total_energy(), energies.stretching(), energies.torsion(),
      energies.bending_2() + energies.bending_3(), utilisation, result.since_edit_ms());
  if (result.has_discretisation_error())
    text +=
        fmt::format("discretisation    {}\n", discretisation_words(result.discretisation_error()));
  for (const auto& snap : beams.snaps())
    text += fmt::format("snap              {}\n", snap_words(snap));
  for (const auto& direction : beams.neutral_directions())
    text += fmt::format("neutral           {}\n", neutral_words(direction));
  if (beams.unjudged_elements_size() > 0)
    text += fmt::format("not judged        {}\n", unjudged_words(beams.unjudged_elements()));
  if (!result.message().empty()) text += result.message() + "\n";
  return text;
}

std::string BeamKind::remark(const v1::ResultInfo& result) const {
  const auto& error = result.discretisation_error();
  std::string overload = overload_words(result.beams().largest_utilisation());
  if (error.compared_elements() == 0) return overload;
  return fmt::format("{}, off by {:.2g} % of the size, moments by {:.2g} %", overload,
                     100 * error.position_error(), 100 * error.moment_error());
}

}  // namespace

const Kind& kind() {
  static const BeamKind kKind;
  return kKind;
}

}  // namespace limber::cli::beams
