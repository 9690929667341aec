#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/spacetime/lanes.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// The rows of A (see NOTATION.md) have the same three numbers in every frame: 1, centre, next.
struct ModeCoefficients {
  Eigen::VectorXd centre;  // -2 - d + lambda, one per lane
  Eigen::VectorXd next;    // 1 + d
};

/// How many frames an end condition holds; nothing for a number that is none.
[[nodiscard]] std::optional<int> pinned_frames(EndCondition end);

/// Which frames are unknowns: those the end conditions leave, first() .. last().
class FreeFrames {
 public:
  explicit FreeFrames(const Timeline& timeline);
  [[nodiscard]] int frame_count() const { return frame_count_; }
  [[nodiscard]] int first() const { return first_; }
  [[nodiscard]] int last() const { return last_; }
  [[nodiscard]] int count() const { return last_ - first_ + 1; }
  [[nodiscard]] bool contains(int frame) const { return frame >= first_ && frame <= last_; }

 private:
  int frame_count_, first_, last_;
};

/// Frames first .. last that nothing constrains. Their z follow from the frames around them; they
/// are eliminated.
struct Run {
  int first, last;
};

/// What an eliminated run costs: two rows over (l1, l2, r1, r2), the two frames before and the two
/// behind it: min over the run of sum_i residual_i^2 = |row 0|^2 + |row 1|^2. Four coefficient
/// columns a row.
struct RunCost {
  Lanes rows;  // lanes x 8: row 0 then row 1
};

/// Eliminates runs by Givens rotations of the residual rows (an orthogonal reduction: nothing is
/// ever squared, so a mode with lambda = 0 loses N^2, not N^4) and gives the frames of a run back
/// from the frames around it:
///   z_j = e1 z_(j+1) + e2 z_(j+2) + f1 z_(l1) + f2 z_(l2).
class RunElimination {
 public:
  RunElimination(const ModeCoefficients& coefficients, const FreeFrames& frames);

  /// Eliminates and remembers the run. Depends on nothing but dynamics, ends and the run itself.
  [[nodiscard]] RunCost eliminate(Run run);

  /// Fills z (modes x frames, its columns around the run valid) in an eliminated run.
  /// @param first  frame of the first column of z
  void fill(Run run, int first, Eigen::MatrixXd& z) const;

 private:
  [[nodiscard]] const double* allowed(Run run, int frame);

  ModeCoefficients coefficients_;
  FreeFrames frames_;
  Eigen::VectorXd forward_[2],
      backward_[2];  // log growth a frame of the two free solutions, larger first
  Eigen::VectorXd none_, all_, mask_[4];
  std::vector<double> memory_;  // [frame][e1 e2 f1 f2][lane]
};

}  // namespace limber::spacetime
