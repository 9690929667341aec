#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/lanes.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// How many frames an end condition holds; empty for a number that is not an end condition.
[[nodiscard]] std::optional<int> pinned_frames(EndCondition end);

/// Which frames are unknowns: those the end conditions leave, first() .. last().
class FreeFrames {
 public:
  explicit FreeFrames(const Timeline& timeline);
  [[nodiscard]] int frame_count() const { return frame_count_; }
  [[nodiscard]] int first() const { return first_; }
  [[nodiscard]] int last() const { return last_; }
  [[nodiscard]] int count() const { return last_ - first_ + 1; }
  [[nodiscard]] bool contains(int frame) const {
    return is_cyclic_ || (frame >= first_ && frame <= last_);
  }
  [[nodiscard]] bool is_cyclic() const { return is_cyclic_; }
  /// In a cycle, the same frame in [0, N).
  [[nodiscard]] int within(int frame) const {
    return is_cyclic_ ? (frame % frame_count_ + frame_count_) % frame_count_ : frame;
  }

 private:
  int frame_count_, first_, last_;
  bool is_cyclic_;
};

/// Unconstrained frames first .. last. Their z follow from the frames around them; they are
/// eliminated. Over the seam of a cycle frames count on from N.
struct Run {
  int first, last;
};

/// The cost of an eliminated run: m = ForceRows::reach() rows over (l1 .. lm, r1 .. rm), the frames
/// before and behind it. The min over the run of sum_i |row_i z|^2 = sum_p |row p|^2.
struct RunCost {
  Lanes rows;  // lanes x (m * 2 m): 2 m coefficients of row 0, then those of the next
};

/// Eliminates runs by Givens rotations of the force rows. That is an orthogonal reduction without
/// squared matrices, so a mode with lambda = 0 loses N^2, not N^4. It gives the frames of a run
/// back from the frames around it:
///   z_j = e1 z_(j+1) + .. + em z_(j+m) + f1 z_(l1) + .. + fm z_(lm).
class RunElimination {
 public:
  RunElimination(ForceRows rows, const FreeFrames& frames);

  /// Eliminates and remembers the run. Depends only on dynamics, ends and the run itself.
  [[nodiscard]] RunCost eliminate(Run run);

  /// Fills z (modes x frames, its columns around the run valid) in an eliminated run.
  /// @param first  frame of the first column of z; of a cycle z may have all frames, or at least
  /// those of the run and around it
  void fill(Run run, int first, Eigen::MatrixXd& z) const;

 private:
  template <int kReach>
  [[nodiscard]] RunCost eliminate_rows(Run run);
  template <int kReach>
  [[nodiscard]] RunCost rows_before(Run run);
  template <int kReach>
  void fill_run(Run run, int first, Eigen::MatrixXd& z) const;
  [[nodiscard]] const double* allowed(Run run, int frame);
  [[nodiscard]] std::size_t place(int frame) const {
    return static_cast<std::size_t>(frames_.within(frame)) * 2 *
           static_cast<std::size_t>(rows_.reach()) * static_cast<std::size_t>(rows_.lanes());
  }

  ForceRows rows_;
  FreeFrames frames_;
  Eigen::VectorXd forward_[2],
      backward_[2];  // log growth a frame of the two free solutions, larger first
  Eigen::VectorXd none_, all_, mask_[4];
  std::vector<double> memory_;  // [frame][e1 .. em f1 .. fm][lane]
};

}  // namespace limber::spacetime
