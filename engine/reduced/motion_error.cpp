#include "engine/reduced/motion_error.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "engine/base/parallel.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced {
namespace {

constexpr Eigen::Index kFramesReconstructedAtOnce = 16;  // reconstructed at once: bounds memory
constexpr Eigen::Index kRowsBetweenChecks = 3072;        // of a product; checks of cancellation

/// One compared frame.
struct FrameError {
  double difference = 0, displacement = 0;  // squares summed over nodes [m^2]
  double distance = 0;                      // [m]
  int inverted = 0;
};

/// a b, on all threads.
Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::MatrixXd& b,
                        const JobContext& job) {
  Eigen::MatrixXd result(a.rows(), b.cols());
  parallel_for(a.rows(), kRowsBetweenChecks, [&](std::int64_t begin, std::int64_t end) {
    job.throw_if_cancelled();
    result.middleRows(begin, end - begin).noalias() = a.middleRows(begin, end - begin) * b;
  });
  return result;
}

int count_inverted(const bodies::GradientOperator& gradient,
                   const Eigen::Ref<const Eigen::VectorXd>& u) {
  int count = 0;
  for (int e = 0; e < gradient.tet_count(); ++e) {
    const Eigen::Matrix3d deformation = Eigen::Matrix3d::Identity() + gradient.apply(u, e);
    if (!(deformation.determinant() > 0)) ++count;
  }
  return count;
}

FrameError compare(const FullShapes& shapes, const Eigen::Ref<const Eigen::VectorXd>& full,
                   const Eigen::Ref<const Eigen::VectorXd>& shown) {
  const Eigen::Index nodes = full.size() / 3;
  const Eigen::Map<const Eigen::Matrix3Xd> u(full.data(), 3, nodes), s(shown.data(), 3, nodes);
  FrameError error;
  const Eigen::RowVectorXd squares = (s - u).colwise().squaredNorm();
  error.difference = squares.sum();
  error.distance = std::sqrt(squares.maxCoeff());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  if (shapes.model().rigid_count > 0) mean = u.rowwise().mean();
  error.displacement = (u.colwise() - mean).squaredNorm();
  error.inverted = count_inverted(shapes.gradient(), shown);
  return error;
}

Eigen::Vector3d mean_displacement(const ShapeTarget& target,
                                  const Eigen::Ref<const Eigen::VectorXd>& u) {
  return mean_rows(u, *target.site);
}

/// @param later, earlier  mean displacements in the target's frames; of a position the later only
void note_miss(const ShapeTarget& target, const std::vector<int>& frames,
               const Eigen::Vector3d& later, const Eigen::Vector3d& earlier, MotionError& error) {
  Eigen::Vector3d missed = later - target.target;
  if (target.since) {
    const int span = frames[static_cast<std::size_t>(target.column)] -
                     frames[static_cast<std::size_t>(*target.since)];
    missed = (later - earlier) / span - target.target;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if ((target.axes >> axis & 1u) == 0) missed[axis] = 0;
  }
  double& largest = target.since ? error.max_velocity_error : error.max_constraint_error;
  double& exact = target.since ? error.max_exact_velocity_error : error.max_exact_error;
  largest = std::max(largest, missed.norm());
  if (target.is_exact) exact = std::max(exact, missed.norm());
}

void note_reach(const Eigen::MatrixXd& linear, const std::vector<int>& frames, Eigen::Index first,
                MotionError& error) {
  const Eigen::VectorXd largest = largest_node_displacement(linear);
  Eigen::Index column = 0;
  const double reach = largest.maxCoeff(&column);
  if (reach <= error.linear_reach) return;
  error.linear_reach = reach;
  error.reach_frame = frames[static_cast<std::size_t>(first + column)];
}

double ratio(double numerator, double denominator) {
  if (numerator == 0) return 0;
  return std::sqrt(numerator / std::max(denominator, numerator * 1e-12));
}

void sum_up(const std::vector<FrameError>& errors, const std::vector<int>& frames,
            MotionError& error) {
  double difference = 0, displacement = 0;
  for (const FrameError& frame : errors) {
    difference += frame.difference;
    displacement += frame.displacement;
  }
  error.frames = static_cast<int>(errors.size());
  error.shape_error = ratio(difference, displacement);
  constexpr double kLeastShare = 0.1;  // of the root mean square displacement
  const double least =
      kLeastShare * kLeastShare * displacement / static_cast<double>(errors.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double alone = ratio(errors[i].difference, std::max(errors[i].displacement, least));
    if (alone > error.worst_frame_error) {
      error.worst_frame_error = alone;
      error.worst_frame = frames[i];
    }
    error.max_distance = std::max(error.max_distance, errors[i].distance);
    if (errors[i].inverted > error.inverted_tets) {
      error.inverted_tets = errors[i].inverted;
      error.inverted_frame = frames[i];
    }
  }
}

}  // namespace

MotionError motion_error(FullShapes& full, const ShownFrames& shown, const JobContext& job) {
  const auto count = static_cast<Eigen::Index>(shown.frames.size());
  const ReducedModel& model = full.model();
  LIMBER_DEMAND(shown.modal.rows() == model.coordinate_count() && shown.modal.cols() == count);
  const Eigen::MatrixXd& basis = shown.basis ? *shown.basis : model.basis;
  LIMBER_DEMAND(shown.coordinates.rows() == basis.cols() && shown.coordinates.cols() == count);
  MotionError error;
  if (count == 0) return error;
  const int rigid = model.rigid_count, elastic = model.coordinate_count() - rigid;
  std::vector<FrameError> errors(shown.frames.size());
  std::vector<Eigen::Vector3d> later(shown.targets.size(), Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> earlier = later;  // of velocities
  for (Eigen::Index first = 0; first < count; first += kFramesReconstructedAtOnce) {
    const Eigen::Index frames = std::min(kFramesReconstructedAtOnce, count - first);
    const auto modal = shown.modal.middleCols(first, frames);
    Eigen::MatrixXd linear =
        product(model.modes.rightCols(elastic), modal.bottomRows(elastic), job);
    note_reach(linear, shown.frames, first, error);
    if (rigid > 0) linear.noalias() += model.modes.leftCols(rigid) * modal.topRows(rigid);
    const Eigen::MatrixXd u = full.displacements(
        std::span(shown.frames)
            .subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(frames)),
        linear, job);
    const Eigen::MatrixXd s =
        product(basis, shown.coordinates.middleCols(first, frames).cast<double>(), job);
    parallel_for(frames, 1, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t i = begin; i < end; ++i) {
        job.throw_if_cancelled();
        errors[static_cast<std::size_t>(first + i)] = compare(full, u.col(i), s.col(i));
      }
    });
    const auto is_here = [&](Eigen::Index column) {
      return column >= first && column < first + frames;
    };
    for (std::size_t i = 0; i < shown.targets.size(); ++i) {
      const ShapeTarget& target = shown.targets[i];
      if (is_here(target.column))
        later[i] = mean_displacement(target, u.col(target.column - first));
      if (target.since && is_here(*target.since))
        earlier[i] = mean_displacement(target, u.col(*target.since - first));
    }
  }
  for (std::size_t i = 0; i < shown.targets.size(); ++i)
    note_miss(shown.targets[i], shown.frames, later[i], earlier[i], error);
  sum_up(errors, shown.frames, error);
  return error;
}

}  // namespace limber::reduced
