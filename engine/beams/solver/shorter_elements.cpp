#include "engine/beams/solver/shorter_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/index.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/balance.h"
#include "engine/beams/solver/certificate.h"
#include "engine/beams/solver/following_tangent.h"
#include "engine/beams/solver/load_path.h"
#include "engine/beams/solver/newton.h"
#include "engine/beams/solver/step_watch.h"
#include "engine/beams/structure/subdivision.h"

namespace limber::beams::detail {
namespace {

// Compression N L^2 / EI and twist [rad] of an element up to which it buckles late by 0.2 % at
// most; then those of the parts that it is cut into. Bending counts as compression.
constexpr double kVisibleCompression = 0.9, kCompressionOfPart = 0.4;
constexpr double kVisibleTwist = 0.15, kTwistOfPart = 0.1;
constexpr int kMaxPartsOfElement = 16;    // of an element
constexpr int kMaxFinerElements = 20000;  // of the cut structure
constexpr double kFinerTolerance = 1e-8;  // of its balance
constexpr int kFinerIterations = 60;      // of Newton's method
constexpr double kFarFromState = 0.6;     // largest turn from the state [rad]
constexpr std::size_t kMaxNamedElements = 3;

int parts_for(double size, double of_part) {
  return static_cast<int>(std::clamp(std::ceil(size / of_part), 2.0, double{kMaxPartsOfElement}));
}

/// Effect of bending about the stiff axis on the weak one, as a compression N L^2 / EI. Lateral
/// buckling has EI u'' + M^2 / GJ u = 0 (Timoshenko and Gere, Theory of Elastic Stability, ch. 6).
/// Round and square sections are as stiff about both axes and do not buckle so.
double compression_by_bending(const BeamSection& section, const ElementExtremes& extremes,
                              double length) {
  const bool is_weak_2 = section.bending_2 < section.bending_3;
  const double weak = is_weak_2 ? section.bending_2 : section.bending_3;
  const double stiff = is_weak_2 ? section.bending_3 : section.bending_2;
  const double moment = extremes[is_weak_2 ? 5 : 4].peak();
  return (1 - weak / stiff) * std::pow(moment * length, 2) / (weak * section.torsion);
}

/// Per element: into how many parts it is to be cut.
std::vector<int> parts_to_judge(const BeamStructure& structure, const BeamState& state) {
  const BeamModel& model = structure.model();
  const BeamResults results = results_of(structure, state);
  std::vector<int> parts(model.elements.size(), 1);
  for (int i = 0; i < structure.elements(); ++i) {
    const BeamElement& element = model.elements[index(i)];
    if (element.kind != BeamKind::kBeam) continue;
    const BeamSection& section = model.sections[index(element.section)];
    const double length = structure.constants(i).length;
    const double pressed =
        -std::min(results.extremes[index(i)][0].least, strain_force(structure, state, i));
    const double compression =
        pressed * length * length / std::min(section.bending_2, section.bending_3) +
        compression_by_bending(section, results.extremes[index(i)], length);
    if (compression > kVisibleCompression)
      parts[index(i)] = parts_for(std::sqrt(compression), std::sqrt(kCompressionOfPart));
    const double twist = std::abs(results.forces[index(i)].torque) * length / section.torsion;
    if (twist > kVisibleTwist)
      parts[index(i)] = std::max(parts[index(i)], parts_for(twist, kTwistOfPart));
  }
  return parts;
}

/// The structure with its elements cut, in the equilibrium beside a state.
struct FinerStructure {
  Subdivision subdivision;
  BeamStructure structure;
  BeamState state;

  /// @returns whether there is one
  [[nodiscard]] bool balance(const JobContext& context) {
    const BeamState carried = state;
    BeamReport report;
    if (balance_following(structure, NodeLoads::of(structure.model()), kFinerTolerance, context,
                          state, report))
      return turn_between(structure, carried, state).angle < kFarFromState;
    // A tangent that is singular, at a neutral direction.
    state = carried;
    NewtonSolver newton(structure, context);
    const NewtonOutcome outcome = newton.balance(state, LoadPath::at_once(structure, state), 1,
                                                 kFinerTolerance, kFinerIterations);
    return outcome == NewtonOutcome::kBalanced && newton.saddles() == 0 &&
           turn_between(structure, carried, state).angle < kFarFromState;
  }
};

/// The element that a node of the cut structure is on; -1: where elements meet.
int element_at(const FinerStructure& finer, int node) {
  if (node < finer.subdivision.given_nodes()) return -1;
  const auto& elements = finer.structure.model().elements;
  const auto found = std::find_if(elements.begin(), elements.end(),
                                  [node](const BeamElement& e) { return e.finish == node; });
  return finer.subdivision.element_of_part(static_cast<int>(found - elements.begin()));
}

std::string names_of_elements(const BeamModel& model, const std::vector<int>& elements) {
  std::string names;
  for (std::size_t i = 0; i < std::min(elements.size(), kMaxNamedElements); ++i)
    names += (i > 0 ? ", " : "") + element_name(model, elements[i]);
  if (elements.size() > kMaxNamedElements)
    names += fmt::format(" and {} others", elements.size() - kMaxNamedElements);
  return names;
}

}  // namespace

std::optional<ShorterElements> look_with_shorter_elements(const BeamStructure& structure,
                                                          const BeamState& state,
                                                          const JobContext& context) {
  using Result = ShorterElements::Result;
  const std::vector<int> parts = parts_to_judge(structure, state);
  ShorterElements judgement;
  for (int i = 0; i < structure.elements(); ++i) {
    if (parts[index(i)] > 1) judgement.elements.push_back(i);
  }
  if (judgement.elements.empty()) return {};
  BeamModel model = structure.model();
  model.element_parts.clear();
  model.temporary_loads.clear();
  const Subdivision subdivision(model, parts);
  BeamReport report;
  if (subdivision.elements() <= kMaxFinerElements) {
    FinerStructure finer{subdivision, BeamStructure(cut_model(model, subdivision)),
                         carry_state(structure, Subdivision::even(model, 1), state, subdivision)};
    if (finer.balance(context)) {
      report.status = BeamStatus::kConverged;
      certify(finer.structure, context, NodeLoads::of(finer.structure.model()), finer.state,
              report);
      if (report.converged()) judgement.result = Result::kStable;
      if (report.negative_eigenvalues.value_or(0) > 0) judgement.result = Result::kUnstable;
      if (report.node >= 0) judgement.node = subdivision.nearest_node(report.node);
      if (const int element = element_at(finer, report.node); element >= 0)
        judgement.elements = {element};
    }
  }
  judgement.parts = parts[index(judgement.elements[0])];
  if (judgement.result == Result::kStable) judgement.elements.clear();
  const std::string names = names_of_elements(structure.model(), judgement.elements);
  if (judgement.result == Result::kUnstable)
    judgement.message = fmt::format(
        "balanced, but unstable where {} {} cut into {} parts: the elements are too long to show "
        "how they buckle; take shorter ones",
        names, judgement.elements.size() == 1 ? "is" : "are", judgement.parts);
  if (judgement.result == Result::kNotJudged)
    judgement.message = fmt::format(
        "stability not judged: {} {} too long to show {} buckling, and {}", names,
        judgement.elements.size() == 1 ? "is" : "are",
        judgement.elements.size() == 1 ? "its own" : "their own",
        subdivision.elements() > kMaxFinerElements
            ? fmt::format("cut into {} shorter ones they are too many", subdivision.elements())
            : "no equilibrium of shorter elements was found beside this one");
  return judgement;
}

}  // namespace limber::beams::detail
