#pragma once

#include <string>

#include "engine/base/job.h"
#include "engine/rods/equilibrium/discretisation_error.h"

namespace limber::session {

struct LinkageResult;
class LinkageStatics;

/// The discretisation error of a linkage's edges for a shape that a session shows. Lengths in the
/// scene's unit.
struct ShapeCheck {
  rods::DiscretisationError error;
  double size = 1;       // of the linkage as drawn: the longest side of its bounding box
  double tolerance = 0;  // of position_error(): the scene's; 0: it names none
  double check_ms = 0;   // that it took

  [[nodiscard]] double position_error() const { return error.max_distance / size; }
  [[nodiscard]] bool within_tolerance() const {
    return error.is_known() && (!(tolerance > 0) || position_error() <= tolerance);
  }
};

/// The problem of the shape and its remedy; empty if its tolerance is met or there is none.
[[nodiscard]] std::string describe_shape(const ShapeCheck& check);

/// Checks shapes of one session. For one thread at a time.
class ShapeChecker {
 public:
  /// @param statics  of the session, with any sizes
  ShapeChecker(const LinkageStatics& statics, double tolerance);

  /// @param result  final and reached: it has its state
  /// @throws Error{kCancelled}
  [[nodiscard]] ShapeCheck check(const LinkageResult& result, const JobContext& job = {});

 private:
  double size_, tolerance_;
  rods::DiscretisationEstimator estimator_;
};

}  // namespace limber::session
