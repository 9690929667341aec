#pragma once

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/modal_analysis.h"

namespace limber::bodies {

struct SmoothModesOptions {
  int mode_count = 10;      // elastic modes wanted, > 0; fewer where the space has no more
  int function_count = 12;  // smooth functions that are multiplied by affine fields, > 0

  void validate() const;
};

/// Approximate modes, without a factor of the stiffness matrix. Rayleigh-Ritz on products of the
/// first eigenfunctions of the mesh's scalar Laplacian with the twelve affine fields (the subspace
/// of Benchekroun et al. 2023, "Fast complementary dynamics via skinning eigenmodes"). Frequencies
/// are too high by 1 to 20 % on compact bodies (the first ones least), by up to 70 % if thin
/// branches swing. The cost is one scalar factor and a few products: a third of the time of
/// modal_analysis() or less, at 90,000 tets a tenth. Vectors are normalised with the lumped mass;
/// max_residual is not determined (1).
/// @throws Error{kNumerical} where the space has no elastic mode
[[nodiscard]] ModalBasis smooth_modes(const ElasticBody& body, const SmoothModesOptions& options,
                                      const JobContext& job = {});

}  // namespace limber::bodies
