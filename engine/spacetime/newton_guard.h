#pragma once

namespace limber::spacetime {

/// Keeps a Newton system H = H_GN - part * curvature + shift I positive definite, with steps that
/// the merit accepts. There are two methods, since each fails where the other does well:
///
/// kShift bounds the length of the step at the knots (Levenberg's trust region). A long path along
/// a straight valley takes many of its steps.
/// kPart takes as much of the curvature as leaves H definite; the line search does the rest. An H
/// close to singular gives steps of any length that are then cut to a thousandth.
///
/// kShift comes first; a run of shortened steps changes to kPart, cut or refused steps change back.
class NewtonGuard {
 public:
  void reset() { *this = {}; }
  /// @param norm  of the largest knot's curvature block: the unit of shifts
  void set_curvature(double norm);

  [[nodiscard]] double part() const { return part_; }    // [0, 1]
  [[nodiscard]] double shift() const { return shift_; }  // >= 0
  /// Whether H is the unchanged full model.
  [[nodiscard]] bool idle() const { return part_ == 1 && shift_ == 0; }
  /// H was not positive definite. @returns false when no option is left.
  [[nodiscard]] bool strengthen();
  /// After a step with this H.
  /// @param gain   decrease over what the model promised; 0 if the step was refused
  /// @param taken  part of the step that was taken
  void judge(double gain, double taken);
  /// Steps that the line search may try before another H is the better answer.
  [[nodiscard]] int attempts() const;
  /// Whether judge() after a refused step has made an H worth trying.
  [[nodiscard]] bool may_retry() const;

 private:
  enum class Method { kPart, kShift };
  void begin(Method method);
  void raise_shift(double factor);
  [[nodiscard]] bool shift_may_grow() const;

  Method method_ = Method::kShift;
  double part_ = 1, shift_ = 0, curvature_ = 0;
  bool changed_ = false;  // the last judgement switched the method
  int cut_ = 0;           // kPart: steps cut short since it began
  int shortened_ = 0;     // kShift: steps in a row with a shift
};

}  // namespace limber::spacetime
