#pragma once

#include "engine/scene/scene.h"

namespace limber::testing {

/// The paper's form, without damping: what literal baselines and its tables are of.
[[nodiscard]] inline scene::Dynamics published_dynamics(
    double period_frames = scene::Dynamics().period_frames) {
  scene::DynamicsRequest dynamics;
  dynamics.period_frames = period_frames;
  return dynamics.resolved(scene::Discretisation::kDifferences);
}

/// The request that is answered with these dynamics.
[[nodiscard]] inline scene::DynamicsRequest requested(const scene::Dynamics& dynamics) {
  return {dynamics.frames_per_second, dynamics.period_frames, dynamics.damping_ratio,
          dynamics.discretisation, dynamics.force_smoothing};
}

}  // namespace limber::testing
