#include "engine/rods/equilibrium/discretisation_error.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/equilibrium/floating_parts.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_strains.h"

namespace limber::rods {
namespace {

/// Share of the whole error that halving changes: 1 - (1/2)^2 for a scheme of second order.
constexpr double kChangedShare = 0.75;
/// Turned by more than that, the shape with half edges may be on another branch [rad].
constexpr double kSameBranch = 1;
/// Strain of rounding: elastic energies below it are none.
constexpr double kNoStrain = 1e-9;

int edges_of(const LinkageModel& model) {
  int edges = 0;
  for (int s = 0; s < model.variables().segments(); ++s) edges += model.variables().edges(s);
  return edges;
}

/// The same for half edges: points along segments are counted in edges.
Conditions halved(const HalvedLinkage& linkage, const LinkageModel& given, Conditions conditions) {
  for (TargetSpring& spring : conditions.springs) {
    const auto arc_at = [&](int segment, double place) {
      return ArcPoint{segment, linkage.halved_place(segment, place) /
                                   linkage.model().variables().edges(segment)};
    };
    if (const auto* const arc = std::get_if<ArcPoint>(&spring.at)) {
      spring.at = arc_at(arc->segment, arc->share * given.variables().edges(arc->segment));
    } else if (const auto* const vertex = std::get_if<VertexPoint>(&spring.at)) {
      spring.at = arc_at(vertex->segment, vertex->vertex);
    }
  }
  return conditions;
}

double unstrained_energy(const LinkageModel& model) {
  return 0.5 * model.stiffness().stretching * kNoStrain * kNoStrain * model.segment_lengths().sum();
}

}  // namespace

DiscretisationEstimator::DiscretisationEstimator(const LinkageModel& model,
                                                 std::optional<LinkageStressModel> stresses)
    : halved_(model), stresses_(std::move(stresses)), equilibrium_(halved_.model()) {}

DiscretisationError::Stress DiscretisationEstimator::stress_error(
    const LinkageModel& model, const LinkageState& state, const LinkageState& halved) const {
  const auto largest = [&](const LinkageModel& of, const LinkageState& shape) {
    return largest_stresses(stresses_->evaluate(of, linkage_strains(of, shape)));
  };
  const Eigen::VectorXd given = largest(model, state), fine = largest(halved_.model(), halved);
  const Eigen::VectorXd errors = (fine - given) / kChangedShare;
  DiscretisationError::Stress result;
  Eigen::Index segment = 0;
  result.error = errors.cwiseAbs().maxCoeff(&segment);
  result.segment = static_cast<int>(segment);
  const double limit = (given + errors).maxCoeff();
  if (limit > kNoStrain * stresses_->youngs_modulus()) result.share = result.error / limit;
  return result;
}

DiscretisationError DiscretisationEstimator::estimate(const LinkageModel& model,
                                                      const LinkageState& state,
                                                      const Conditions& conditions,
                                                      const JobContext& job) {
  halved_.set_sizes(model);
  job.throw_if_cancelled();
  const LinkageModel& fine = halved_.model();
  const LinkageState begin = halved_.prolonged(model, state);
  LinkageState end = begin;
  const Conditions held = halved(halved_, model, conditions);
  const EquilibriumReport report = equilibrium_.solve(end, held, {}, job);
  job.throw_if_cancelled();
  keep_in_place(fine, {}, held, begin, end);

  DiscretisationError result;
  result.edges = edges_of(model);
  result.compared_edges = edges_of(fine);
  result.iterations = report.iterations;
  if (!report.converged()) {
    result.message = fmt::format("with half edges there is no equilibrium: {}", report.message);
    return result;
  }
  if (report.turned > kSameBranch) {
    result.message = fmt::format(
        "the nearest equilibrium with half edges is {:.0f} degrees away, maybe on another branch",
        report.turned / kDegree);
    return result;
  }
  const HalvedLinkage::Distance distance = halved_.distance(model, state, end);
  result.max_distance = distance.largest / kChangedShare;
  result.worst_segment = distance.segment;
  const auto& joints = model.graph().segments[static_cast<std::size_t>(distance.segment)].joints;
  const bool near_start = 2 * distance.place < model.variables().edges(distance.segment);
  result.worst_joint = joints[near_start ? kStart : kFinish];
  if (result.worst_joint < 0) result.worst_joint = joints[near_start ? kFinish : kStart];

  LinkageAssembly given_assembly(model), fine_assembly(fine);
  const double given_energy = given_assembly.energies(state).total();
  const double fine_energy = fine_assembly.energies(end).total();
  result.energy_changes = fine_assembly.segment_energies() - given_assembly.segment_energies();
  const double error = (fine_energy - given_energy) / kChangedShare;
  const double limit = given_energy + error;
  if (std::abs(limit) > unstrained_energy(model)) result.energy_error = std::abs(error / limit);
  if (stresses_) result.stress = stress_error(model, state, end);
  return result;
}

}  // namespace limber::rods
