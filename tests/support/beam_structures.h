#pragma once

#include "engine/base/random.h"
#include "engine/beams/model/beam_model.h"
#include "engine/scene/formats/beam_job.h"

namespace limber::testing {

/// The torsion constant that a job's section gets.
enum class JobTorsion {
  kSaintVenant,  // of the rectangle
  kPolar,        // I_2 + I_3
};

/// A job as a structure: fixed directions 3 to 5 (components of the normal and spin about it) are
/// the rotations, all held where any is.
[[nodiscard]] beams::BeamModel model_of(const scene::BeamJobFiles& files,
                                        JobTorsion torsion = JobTorsion::kSaintVenant);

/// The same with each element cut into equal parts; nodes of the model come first.
[[nodiscard]] beams::BeamModel refined(const beams::BeamModel& model, int parts);

/// Diagonal of the box around all nodes [length].
[[nodiscard]] double extent_of(const beams::BeamModel& model);

[[nodiscard]] Eigen::Vector3d random_direction(Random& random);

}  // namespace limber::testing
