#pragma once

#include <Eigen/Core>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// The largest turn of a node, a released end or an element's chord.
struct Turn {
  double angle = 0;  // [rad]
  int node = -1;     // where it is
};
[[nodiscard]] Turn turn_between(const BeamStructure& structure, const BeamState& from,
                                const BeamState& to);

/// Checks whether load steps continue as the one before went, which distinguishes the followed
/// branch from another that Newton's method may land on.
///
/// On a branch, the swerve of a step from a straight line goes with the square of its length, close
/// to a fold with the root. If the branch is left, the swerve stays the same however short the
/// step.
class StepWatch {
 public:
  /// @param largest_swerve  of a step that is taken [rad], > 0
  /// @param shortest  steps are not cut below it: a swerve that such a step does not make small is
  ///                  a jump
  StepWatch(const BeamStructure& structure, double largest_swerve, double shortest)
      : structure_(structure), largest_(largest_swerve), shortest_(shortest) {}

  enum class Judgement {
    kContinues,  // the next step is compared with this one
    kTooFar,     // once more, shorter
    kJump,       // to another branch, by a snap or a fork; the next step is a first one
  };
  /// Judges a step from s to `next`, shares of the path.
  [[nodiscard]] Judgement judge(const BeamState& from, const BeamState& to, double s, double next);
  /// Does a step go elsewhere than the one before leads to? A first one always does.
  [[nodiscard]] bool surprises(const BeamState& from, const BeamState& to, double step) const;
  /// The step that was judged was taken where it went, although it was too far.
  void forget();

  struct Verdict {
    double swerve = 0;  // from straight on; of a first step half of all it makes [rad]
    double turn = 0;    // the largest [rad]
    int node = -1;      // where the swerve is
  };
  /// Verdict on a step that is not judged.
  [[nodiscard]] Verdict look(const BeamState& from, const BeamState& to, double step) const;
  /// Verdict on the last step that was judged.
  [[nodiscard]] const Verdict& verdict() const { return verdict_; }
  /// By which the next step may be longer, or must be shorter, than the last one judged.
  [[nodiscard]] double factor() const { return factor_; }

 private:
  [[nodiscard]] Verdict look(const Eigen::Matrix3Xd& made, double step) const;
  /// By more than it advanced before: no smooth path does that in one step.
  [[nodiscard]] bool goes_back(const Eigen::Matrix3Xd& made, double step) const;
  [[nodiscard]] bool is_jump(double step, double next) const;

  const BeamStructure& structure_;
  const double largest_;
  const double shortest_;
  Eigen::Matrix3Xd last_;
  double step_ = 0;  // 0: there is no last
  Verdict verdict_;
  double factor_ = 1;
  // The last step that went too far: where to, and its swerve; how often that did not get smaller.
  double too_far_at_ = 0, too_far_swerve_ = 0;
  int times_ = 0;
};

}  // namespace limber::beams::detail
