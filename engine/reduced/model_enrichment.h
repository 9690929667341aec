#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

/// How a model is to learn the frames of a motion.
struct EnrichmentOptions {
  double tolerance = 0.01;  // of the shape error over the frames, in (0, 1)
  int max_columns = 24;     // added to the basis at most, >= 0
  int tets = 16;            // added to the cubature, >= 0
  int kept_poses = 300;     // random training poses that the maps are held to, >= 20
  double amplitude = 0.5;   // of these, as ModelOptions::amplitude
  std::uint64_t seed = 1;

  void validate() const;
};

struct EnrichmentReport {
  int columns = 0, tets = 0;  // added
  double weight = 0;  // of the frames against the kept poses, each set as a whole; 0: maps stayed
  /// Root mean square error over the frames, relative to their displacements, as
  /// MotionError::shape_error: of the model before, of the basis alone, of the model after.
  double error_before = 0, basis_error = 0, error_after = 0;
  /// Mean relative errors on random poses that had no part in the fit.
  double kept_before = 0, kept_after = 0;

  [[nodiscard]] bool met(double tolerance) const { return error_after <= tolerance; }
};

struct EnrichedModel {
  ReducedModel model;
  EnrichmentReport report;
};

/// The model with frames of a motion learnt: up to `max_columns` principal components of what its
/// basis misses of their full reconstructions, and corrections of its maps, fitted by ridge
/// regression on the features r(y) of its cubature tets and `tets` further ones. The fit sees the
/// frames at 0.7, 1 and 1.3 times their size and random poses as those of training; the weight
/// between both and the ridge are those of the smallest error on frames left out of the fit, among
/// the ones that leave the error on held-out random poses below 1.25 times what it was.
/// The first columns of the basis, tets and modes are those of `model`; z means the same. Of a free
/// body turns stay exact. Deterministic, whatever the number of threads.
/// @param z  R x k, modal coordinates of the frames, k >= 1; without base motion
/// @throws Error for bad options or sizes, Error{kCancelled}
[[nodiscard]] EnrichedModel enrich_model(const bodies::ElasticBody& body, const ReducedModel& model,
                                         const FullReconstruction& full,
                                         const Eigen::Ref<const Eigen::MatrixXd>& z,
                                         const EnrichmentOptions& options,
                                         const JobContext& job = {});

}  // namespace limber::reduced
