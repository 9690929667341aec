#include "tests/support/charted_relaxation.h"

#include <algorithm>
#include <cmath>

namespace limber::testing {

using beams::BeamStatus;

namespace {

/// The moving structure.
class Charted {
 public:
  Charted(const ChartedStructure& structure, const ChartedOptions& options)
      : structure_(structure), options_(options), unknowns_(structure.rest()) {
    velocity_.setZero(6, structure.nodes());
    farthest_ = 1e3 * (1 + unknowns_.topRows<3>().cwiseAbs().maxCoeff());
  }

  /// False where numbers have grown beyond any shape of the structure; nothing has moved then.
  bool step() {
    const bool pushed = steps_ < options_.temporary_until && structure_.has_temporary_loads();
    const ChartedUnknowns forces = structure_.unbalanced(
        unknowns_, pushed ? ChartedStructure::Temporary::kOn : ChartedStructure::Temporary::kOff);
    if (!forces.allFinite()) return false;
    residual_ = forces.colwise().norm().sum();
    masses_ = structure_.masses(unknowns_);
    acceleration_ = forces;
    for (int i = 0; i < structure_.nodes(); ++i) {
      acceleration_.col(i).head<3>() /= options_.mass_factor * masses_.translation[i];
      acceleration_.col(i).tail<3>() /= options_.mass_factor * masses_.rotation[i];
    }
    energy_before_ = energy_;
    velocity_ += time_step_ * acceleration_;
    measure_energy();
    return move();
  }

  /// Back by the last step, and on from rest.
  bool damp() {
    unknowns_ -= time_step_ * velocity_;
    settle();
    velocity_ = 0.5 * time_step_ * acceleration_;
    measure_energy();
    ++peaks_;
    const bool moved = move();
    if (steps_ >= options_.slower_from) time_step_ *= options_.slower;
    return moved;
  }

  void count() { ++steps_; }
  [[nodiscard]] bool past_peak() const { return energy_before_ > energy_; }
  /// Loads and motions are as they will stay.
  [[nodiscard]] bool settled() const {
    return peaks_ > 0 && steps_ > 20 &&
           (!structure_.has_motions() || steps_ > options_.motion_until) &&
           (!structure_.has_temporary_loads() || steps_ > options_.temporary_until);
  }
  [[nodiscard]] bool balanced() const { return residual_ < options_.residual; }
  [[nodiscard]] bool resting() const { return energy_of_translations_ < options_.rest_energy; }
  [[nodiscard]] int steps() const { return steps_; }

  [[nodiscard]] ChartedResult result(BeamStatus status) const {
    return {status, unknowns_, steps_, peaks_, residual_};
  }

 private:
  bool move() {
    const ChartedUnknowns before = unknowns_;
    unknowns_ += time_step_ * velocity_;
    settle();
    // The comparison is false for what is no number.
    if (unknowns_.cwiseAbs().maxCoeff() < farthest_ && unknowns_.allFinite()) return true;
    unknowns_ = before;
    return false;
  }

  /// Motions are brought on, and normals that have left the disc are brought back to its rim.
  void settle() {
    const double ramp = options_.motion_until - options_.motion_from;
    structure_.drive(unknowns_, std::clamp((steps_ - options_.motion_from) / ramp, 0.0, 1.0));
    for (int i = 0; i < structure_.nodes(); ++i) {
      const double rho = unknowns_.col(i).segment<2>(3).norm();
      if (rho > 1) unknowns_.col(i).segment<2>(3) /= rho;
    }
  }

  void measure_energy() {
    energy_of_translations_ = energy_ = 0;
    for (int i = 0; i < structure_.nodes(); ++i) {
      const auto v = velocity_.col(i);
      energy_of_translations_ += 0.5 * masses_.translation[i] * v.head<3>().squaredNorm();
      energy_ += 0.5 * masses_.rotation[i] * v.tail<3>().squaredNorm();
    }
    energy_of_translations_ *= options_.mass_factor;
    energy_ = options_.mass_factor * energy_ + energy_of_translations_;
  }

  const ChartedStructure& structure_;
  const ChartedOptions& options_;
  ChartedUnknowns unknowns_, velocity_, acceleration_;
  ChartedStructure::Masses masses_;
  double time_step_ = 1, farthest_ = 0, residual_ = 0;
  double energy_ = 0, energy_before_ = 0, energy_of_translations_ = 0;
  int steps_ = 0, peaks_ = 0;
};

}  // namespace

ChartedResult relax_charted(const ChartedStructure& structure, const ChartedOptions& options) {
  Charted moving(structure, options);
  while (moving.steps() < options.steps) {
    if (!moving.step()) return moving.result(BeamStatus::kUnstable);
    moving.count();
    if (moving.settled() && moving.balanced()) return moving.result(BeamStatus::kConverged);
    if (!moving.past_peak()) continue;
    if (moving.settled() && moving.resting()) return moving.result(BeamStatus::kStalled);
    if (!moving.damp()) return moving.result(BeamStatus::kUnstable);
  }
  return moving.result(BeamStatus::kIterationLimit);
}

}  // namespace limber::testing
