#include "engine/session/linkages/ended_designs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace limber::session {
namespace {

constexpr std::size_t kKept = 4;
constexpr double kSame = 1e-2;      // difference up to which two designs are one optimum
constexpr double kSameGoal = 1e-9;  // of distances to it

template <class Item, class Same>
bool same_items(const std::vector<Item>& a, const std::vector<Item>& b, const Same& same) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

/// Do they ask the same of the deployed shape?
bool same_conditions(const scene::LinkageConditions& a, const scene::LinkageConditions& b) {
  return a.mean_angle == b.mean_angle &&
         same_items(a.pins, b.pins,
                    [](const scene::JointPin& p, const scene::JointPin& q) {
                      return p.joint == q.joint && p.held == q.held && p.position == q.position;
                    }) &&
         same_items(a.angles, b.angles, [](const scene::JointAngle& p, const scene::JointAngle& q) {
           return p.joint == q.joint && p.angle == q.angle;
         });
}

bool same_weights(const DesignGoal& a, const DesignGoal& b) {
  const Eigen::VectorXd &p = a.joint_surface_weights, &q = b.joint_surface_weights;
  return a.flat_share == b.flat_share && a.distance_weight == b.distance_weight &&
         a.surface_weight == b.surface_weight && (a.surface == nullptr) == (b.surface == nullptr) &&
         p.size() == q.size() && p == q &&
         same_items(a.targets, b.targets,
                    [](const rods::JointTarget& s, const rods::JointTarget& t) {
                      return s.joint == t.joint && s.weight == t.weight && s.position == t.position;
                    });
}

bool same_variables(const rods::DesignVariables& a, const rods::DesignVariables& b) {
  return a.lengths == b.lengths && a.sections == b.sections;
}

}  // namespace

std::vector<OtherOptimum> EndedDesigns::others_than(
    LiveDesign& design, const DesignInfo& info, const scene::LinkageConditions& conditions) const {
  std::vector<OtherOptimum> others;
  for (const Ended& ended : ended_) {
    if (!same_variables(ended.info.variables, info.variables) ||
        !same_weights(ended.info.goal, info.goal) ||
        ended.requested_flat_angle != design.requested_flat_angle() ||
        ended.info.least_cover != info.least_cover ||
        !same_conditions(*ended.conditions, conditions))
      continue;
    OtherOptimum other{ended.info.tag, design.terms_of(*ended.best),
                       design.difference_from(*ended.best)};
    // Surfaces come anew with each request: they are one where they are as far away.
    const double before = ended.info.best.surface_rms, now = other.terms.surface_rms;
    if (std::abs(before - now) > kSameGoal * (before + design.extent())) continue;
    if (!other.difference.same(design.extent(), kSame)) others.push_back(other);
  }
  return others;
}

double EndedDesigns::energy_scale(const scene::LinkageConditions& conditions) const {
  for (const Ended& ended : ended_)
    if (same_conditions(*ended.conditions, conditions)) return ended.energy_scale;
  return 0;
}

void EndedDesigns::note(const LiveDesign& design, const DesignInfo& info,
                        std::shared_ptr<const scene::LinkageConditions> conditions) {
  ended_.push_back({info, design.candidate(), std::move(conditions), design.energy_scale(),
                    design.requested_flat_angle()});
  if (ended_.size() > kKept) ended_.pop_front();
}

}  // namespace limber::session
