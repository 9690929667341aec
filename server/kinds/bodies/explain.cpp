#include "server/kinds/bodies/explain.h"

#include <fmt/format.h>

#include "server/wire/explanation.h"

namespace limber::server {
namespace {

ChosenBy by_scene(bool is_asked_for) { return is_asked_for ? ChosenBy::kScene : ChosenBy::kLimber; }

std::string percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

const char* name_of(proto::Basis basis) {
  switch (basis) {
    case proto::BASIS_MODAL_DERIVATIVES:
      return "modal derivatives";
    case proto::BASIS_MAP_DERIVATIVES:
      return "second derivatives of the map";
    default:
      return "full reconstructions of training poses";
  }
}

std::string reason_of_basis(const proto::ModelInfo& model, const scene::ModelRequest& asked) {
  std::string reason = asked.basis_size > 0 ? std::string("as the scene says")
                       : !model.met_tolerance()
                           ? std::string("the most that are tried: the tolerance is not met")
                           : fmt::format(
                                 "the fewest that keep poses held out of the training "
                                 "within {}",
                                 percent(asked.tolerance));
  reason += fmt::format("; made of {}", name_of(model.basis()));
  if (model.has_snapshot_basis_error() && model.has_derivative_basis_error()) {
    reason += fmt::format(": with {} columns reconstructions leave {}, derivatives {}",
                          model.compared_size(), percent(model.snapshot_basis_error()),
                          percent(model.derivative_basis_error()));
  }
  return reason;
}

std::string reason_of_modes(const proto::ModeChoice& choice) {
  std::string reason;
  switch (choice.state()) {
    case proto::ModeChoice::STATE_NAMED:
      return "as the scene says";
    case proto::ModeChoice::STATE_SETTLED:
    case proto::ModeChoice::STATE_BOUNDED:
      reason = choice.reason();
      break;
    default:
      return fmt::format("the default, the lowest ones; others were not compared{}{}",
                         choice.reason().empty() ? "" : ": ", choice.reason());
  }
  reason += ". Energies of the optimum by the full map:";
  for (const proto::ModeEnergy& one : choice.energies())
    reason += fmt::format(" {:.6g} with {};", one.energy(), one.modes());
  reason.pop_back();
  return reason;
}

/// @param modes  that swing, rigid motions included
void add_choices(const proto::SessionStatus& status, const scene::Scene& scene, int modes,
                 int columns, Explanation& explanation) {
  const proto::ModelInfo& model = status.model();
  const scene::ModelRequest& asked = scene.model;
  explanation.choose("modes (r)", modes, by_scene(scene.model.names_modes()),
                     reason_of_modes(model.mode_choice()), "unknowns of a step grow with it");
  explanation.choose("columns of the model's basis (h)", model.basis_size(),
                     by_scene(asked.basis_size > 0), reason_of_basis(model, asked),
                     model.from_cache()
                         ? std::string("the model came from the cache")
                         : fmt::format("the model took {:.2g} s to build", model.build_s()));
  explanation.choose(
      "cubature tets (T)", model.cubature_size(), by_scene(asked.cubature_size > 0),
      asked.cubature_size > 0 ? std::string("as the scene says")
      : !model.met_tolerance()
          ? fmt::format("of {} tets: the tolerance is not met", status.tets())
          : fmt::format("of {} tets the fewest that meet the same tolerance", status.tets()),
      "reconstructing a frame grows with h times T");
  if (columns != static_cast<int>(model.basis_size())) {
    explanation.choose(
        "columns of the shown basis (h')", columns, ChosenBy::kLimber,
        fmt::format("{} joined the model's own, since full shapes of motions of this session "
                    "leave those; the oldest go when there are more than needed",
                    columns - static_cast<int>(model.basis_size())),
        fmt::format("{} bytes a frame in COORDINATES", 4 * columns));
  }
  const proto::ResultInfo& result = status.result();
  explanation.choose(
      "path of the solve",
      result.exact() ? "reduced model, then the full rotation-strain map" : "reduced model",
      ChosenBy::kLimber,
      result.exact() ? "the model answers first; the final result has values and Jacobians of all "
                       "tets at constrained nodes, frames are full reconstructions"
      : result.converged()
          ? "the exact step was cancelled, or a fit of the material was not better with it"
          : "the exact step follows when edits pause",
      time_since_edit(result));
}

void add_errors(const proto::SessionStatus& status, const scene::Scene& scene,
                Explanation& explanation) {
  const proto::ResultInfo& result = status.result();
  const double tolerance = scene.model.tolerance;
  if (result.has_motion_error()) {
    const proto::MotionError& error = result.motion_error();
    explanation.expect(
        "shapes of the shown motion", error.shape_error(), "",
        fmt::format("compared with full reconstructions of {} frames", error.frames()), tolerance);
    explanation.expect("nodes of the shown motion, the worst, of the body's length",
                       error.max_distance_share(), "", "found in the same frames");
  } else {
    explanation.expect("shapes of the shown motion", {}, "",
                       "compared with full reconstructions after the final result: wait until "
                       "checked",
                       tolerance);
  }
  explanation.expect(
      "shapes while edits come, from the reduced model alone", status.model().error_mean(), "",
      "mean over poses held out of the training; motions may go elsewhere", tolerance);
  const proto::ModeChoice& choice = status.model().mode_choice();
  if (choice.has_saving()) {
    explanation.expect("energy, against the optimum near by with more modes", choice.saving(), "",
                       fmt::format("found with {} of them when the modes were last compared",
                                   choice.energies(choice.energies_size() - 1).modes()),
                       tolerance);
  } else {
    explanation.expect("energy, against the optimum near by with more modes", {}, "",
                       choice.state() == proto::ModeChoice::STATE_NAMED
                           ? "not compared, since the scene names them: leave model.modes out"
                           : "not compared: wait until checked, or see modes (r)");
  }
  if (result.exact()) {
    explanation.expect("energy, against the optimum near by with these modes", result.gradient(),
                       "",
                       "the scale-free gradient of the full map where the solve ended, which "
                       "bounds it near a minimum");
  } else {
    explanation.expect("energy, against the optimum near by with these modes", {}, "",
                       "this result is of the reduced model, whose energies may be off by much "
                       "more than its shapes; the exact result follows");
  }
}

}  // namespace

proto::ExplainResponse explain_body(const proto::SessionStatus& status,
                                    const session::BodySession& session, int columns) {
  Explanation explanation(status.result().revision());
  const scene::Scene scene = session.scene();
  const int modes = session.mode_choice().modes + session.model()->rigid_count;
  add_choices(status, scene, modes, columns, explanation);
  const auto picture = session.first_picture();
  explanation.choose(
      "first picture", picture ? fmt::format("of {} modes", picture->modes) : "none",
      ChosenBy::kLimber,
      picture ? fmt::format("a coarse model was shown until this one was built; it had its own "
                            "motions with a mean shape error of {}",
                            percent(picture->error_mean))
              : "the model came from the cache, the body is small, or the motion is long");
  add_errors(status, scene, explanation);
  const double tolerance = scene.model.tolerance;
  explanation.advise(
      "half the error while edits come",
      fmt::format("model.tolerance {:g} in place of {:g}: a larger basis and more cubature tets; "
                  "bytes and time of a frame grow with them. Final results are exact with either",
                  tolerance / 2, tolerance));
  explanation.advise(
      "half the time of a step",
      fmt::format("model.modes {} in place of {}: shapes of the highest modes are lost, and the "
                  "optimum with them changes",
                  std::max(1U, status.model().modes() * 3 / 4), status.model().modes()));
  const proto::ModeChoice& choice = status.model().mode_choice();
  if (choice.fewer() > 0 && choice.fewer() < choice.modes()) {
    explanation.advise("fewer unknowns at the same energy",
                       fmt::format("model.modes {} in place of {}: the optimal energy of this "
                                   "problem changes by less than {}",
                                   choice.fewer(), choice.modes(), percent(tolerance / 4)));
  }
  if (choice.state() == proto::ModeChoice::STATE_BOUNDED && choice.has_saving() &&
      choice.saving() > tolerance) {
    explanation.advise("a lower energy",
                       fmt::format("model.modes above {}, by name: the last comparison still saved "
                                   "{} of the energy",
                                   choice.modes(), percent(choice.saving())));
  }
  return explanation.response();
}

}  // namespace limber::server
