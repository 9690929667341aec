#include "engine/rods/design/design_merit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::rods::detail {

// The numbers of this file are dimensionless: factors of weights, shares of the objective, counts
// of iterations of the search. None is known to have been tuned.

void AugmentedConstraint::update(double g) {
  constexpr double kGrowth = 4;  // of the penalty, from one update to the next
  constexpr double kMinLeftShare =
      0.25;  // of the violation: with more than that left, the penalty grows
  const double now = left(g);
  const bool slow = now > DesignRank::kHolds && left_ > 0 && now > kMinLeftShare * left_;
  // A violated constraint is pressed harder at once; one that is pressed too much is released
  // gradually.
  if (slow && g < 0) penalty_ *= kGrowth;
  multiplier_ = force(g);
  if (slow && g >= 0) penalty_ *= kGrowth;
  left_ = now;
}

bool GuardWeight::raise(double objective, double flat_energy) {
  constexpr double kFirstGuardShare = 1e-2;  // of the objective that the guard is at first
  constexpr double kRise = 5;                // of the weight, from one raise to the next
  constexpr int kOften = 12;                 // raises in all; then there are no more
  if (raised_ == kOften) return false;
  if (first_ == 0)
    first_ = flat_energy > 0 ? kFirstGuardShare * std::abs(objective) / flat_energy : 0;
  const double lost = weight_ > 0 ? weight_ : last_;
  weight_ = weight_ > 0 ? kRise * weight_ : last_ > 0 ? last_ : first_;
  // To the geometric mean, by orders of magnitude, to what kept the shape the last time: as a share
  // of the objective, which the guard is weighed against.
  weight_ = std::max(weight_, std::sqrt(lost * kept_ * std::abs(objective)));
  if (objective != 0) kept_ = weight_ / std::abs(objective);
  constexpr double kGentlest = 0.6;  // of lower()'s factor, which raises bring closer to one
  if (raised_ >= kAtOnce) fall_ = std::min(kGentlest, std::sqrt(fall_));
  ++raised_;
  return first_ > 0;
}

void GuardWeight::raise_at_once(double objective, double flat_energy) {
  bool of_use = true;
  while (of_use && raised_ < kAtOnce) of_use = raise(objective, flat_energy);
}

bool GuardWeight::hinders(double objective, double flat_energy) const {
  constexpr double kMaxGuardShare =
      0.5;  // of the objective that the guard may be without hindering
  return weight_ * flat_energy > kMaxGuardShare * std::abs(objective);
}

void GuardWeight::lower() {
  constexpr double kNothing = 1e-6;  // of the first weight: below it the guard is off
  last_ = weight_;
  weight_ *= fall_;
  if (weight_ < kNothing * first_) weight_ = 0;
}

ViolationWatch::Verdict ViolationWatch::see(double violation, int iteration) {
  constexpr double kNearer = 0.99;  // of the least violation so far: below it is progress
  constexpr int kPatience = 15;     // iterations without progress, before the penalty is raised
  constexpr int kVain = 4;          // raises without progress, before the search gives up
  const bool holds = violation <= DesignRank::kHolds;
  if (holds || violation < kNearer * least_) {
    least_ = holds ? std::numeric_limits<double>::infinity() : violation;
    since_ = iteration;
    raised_ = 0;
  }
  if (iteration - since_ < kPatience) return Verdict::kFine;
  since_ = iteration;
  return ++raised_ > kVain ? Verdict::kHopeless : Verdict::kRaise;
}

bool DesignMerit::bounds_angle() const { return options_.smallest_angle > -std::numbers::pi; }

double DesignMerit::flatness_allowed() const {
  const double height = options_.flat_height * design_.criteria().length_scale;
  return height * height * design_.model().variables().joints();
}

double DesignMerit::flat_height(const DesignValues& values) const {
  const double joints = design_.model().variables().joints();
  return std::sqrt(values.flatness / joints) / design_.criteria().length_scale;
}

void DesignMerit::begin() {
  flat_ = angle_ = area_ = {};
  guard_ = {};
}

DesignRank DesignMerit::rank(const DesignValues& values) const {
  return DesignRank::of(values.objective, least_room(values));
}

double DesignMerit::least_room(const DesignValues& values) const {
  double room = flat_room(values);
  if (bounds_angle()) room = std::min(room, angle_room(values));
  if (bounds_area()) room = std::min(room, area_room(values));
  return room;
}

bool DesignMerit::settled(const DesignValues& values) const {
  const auto little = [](double left) { return left <= DesignRank::kHolds; };
  return little(flat_.left(flat_room(values))) &&
         (!bounds_angle() || little(angle_.left(angle_room(values)))) &&
         (!bounds_area() || little(area_.left(area_room(values))));
}

double DesignMerit::value(const DesignValues& values) const {
  double sum =
      values.objective + flat_.value(flat_room(values)) + guard_.weight() * values.flat_energy;
  if (bounds_angle()) sum += angle_.value(angle_room(values));
  if (bounds_area()) sum += area_.value(area_room(values));
  return sum;
}

/// Forces on the variables, and the terms that have to be differentiated for them.
DesignMerit::Forces DesignMerit::forces(const DesignValues& values) const {
  const double flat = flat_.force(flat_room(values));
  const double angle = bounds_angle() ? angle_.force(angle_room(values)) : 0;
  const double area = bounds_area() ? area_.force(area_room(values)) : 0;
  using Which = LinkageDesign::Which;
  return {flat, angle, area, flat > 0 || angle > 0 || area > 0 ? Which::kAll : Which::kObjective};
}

Eigen::VectorXd DesignMerit::gradient(const DesignValues& values) {
  const Forces press = forces(values);
  const DesignMeasures<Eigen::VectorXd>& by = design_.gradients(press.which);
  Eigen::VectorXd sum = by.objective + guard_.weight() * by.flat_energy;
  if (press.flat > 0) sum += press.flat / flatness_allowed() * by.flatness;
  if (press.angle > 0) sum -= press.angle * by.smallest_angle;
  if (press.area > 0) sum -= press.area / design_.criteria().least_area * by.deployed_area;
  return sum;
}

Eigen::VectorXd DesignMerit::product(const DesignValues& values, const Eigen::VectorXd& v) {
  const Forces press = forces(values);
  const double allowed = flatness_allowed();
  const DesignMeasures<Eigen::VectorXd>& by = design_.gradients(press.which);
  const DesignMeasures<Eigen::VectorXd> bent = design_.products(v, press.which);
  Eigen::VectorXd sum = bent.objective + guard_.weight() * bent.flat_energy;
  if (press.flat > 0) {
    sum += press.flat / allowed * bent.flatness +
           flat_.penalty() / (allowed * allowed) * by.flatness.dot(v) * by.flatness;
  }
  if (press.angle > 0) {
    sum += angle_.penalty() * by.smallest_angle.dot(v) * by.smallest_angle -
           press.angle * bent.smallest_angle;
  }
  if (press.area > 0) {
    const double least = design_.criteria().least_area;
    sum += area_.penalty() / (least * least) * by.deployed_area.dot(v) * by.deployed_area -
           press.area / least * bent.deployed_area;
  }
  return sum;
}

void DesignMerit::update_multipliers(const DesignValues& values) {
  flat_.update(flat_room(values));
  if (bounds_angle()) angle_.update(angle_room(values));
  if (bounds_area()) area_.update(area_room(values));
}

}  // namespace limber::rods::detail
