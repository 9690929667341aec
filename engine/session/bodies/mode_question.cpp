#include "engine/session/bodies/mode_question.h"

#include <algorithm>

namespace limber::session {

ModeQuestion mode_question(const ModeProblem& problem, double energy) {
  ModeQuestion question;
  for (const auto& [constraint, site] : problem.constraints) question.groups.insert(site->nodes);
  question.constraints = problem.constraints.size();
  question.timeline = problem.timeline;
  question.dynamics = problem.dynamics;
  question.energy = energy;
  return question;
}

bool is_answered_by(const ModeQuestion& now, const ModeQuestion& before, double energy_factor) {
  const scene::Dynamics &a = now.dynamics, &b = before.dynamics;
  const bool is_same_motion =
      now.timeline.first == before.timeline.first && now.timeline.last == before.timeline.last &&
      a.period_frames == b.period_frames && a.damping_ratio == b.damping_ratio &&
      a.frames_per_second == b.frames_per_second && a.discretisation == b.discretisation &&
      a.force_smoothing == b.force_smoothing && a.inertia == b.inertia;
  const bool is_of_known_groups = std::includes(before.groups.begin(), before.groups.end(),
                                                now.groups.begin(), now.groups.end());
  return is_same_motion && is_of_known_groups && now.constraints <= 2 * before.constraints &&
         before.constraints <= 2 * now.constraints && now.energy <= energy_factor * before.energy &&
         before.energy <= energy_factor * now.energy;
}

}  // namespace limber::session
