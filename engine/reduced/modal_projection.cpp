#include "engine/reduced/modal_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

namespace {

/// Unknowns of a free body that no RS coordinate sees: x, y, z, first.
int translations(const ReducedModel& model) { return model.rigid_count > 0 ? 3 : 0; }

/// Root of the integral of |y|^2. @param y  9m
double volume_norm(const bodies::GradientOperator& gradient, const Eigen::VectorXd& y) {
  double square = 0;
  for (int e = 0; e < gradient.tet_count(); ++e)
    square += gradient.volumes()[e] * y.segment<kRsSize>(kRsSize * Eigen::Index{e}).squaredNorm();
  return std::sqrt(square);
}

/// Least squares over all tets by volume or over some tets: y to z without translations.
class Fit {
 public:
  Fit(const bodies::GradientOperator& gradient, const ReducedModel& model,
      const ProjectionOptions& options)
      : gradient_(gradient), model_(model), tets_(options.tets) {
    const int unknowns = model.coordinate_count() - translations(model);
    modes_ = model.modes.rightCols(unknowns);
    if (tets_ == ProjectionTets::kCubature) {
      rs_modes_ = model.rs_modes.rightCols(unknowns);
      const ThinSvd svd = thin_svd(rs_modes_);
      count_rank(svd.values, options.rank_tolerance);
      inverse_ = svd.v.leftCols(rank_) * svd.values.head(rank_).cwiseInverse().asDiagonal() *
                 svd.u.leftCols(rank_).transpose();
    } else {
      Eigen::MatrixXd gram(unknowns, unknowns);
      for (int k = 0; k < unknowns; ++k)
        gram.col(k) = transposed(linear_coordinates(gradient, modes_.col(k)));
      // Largest first. The square root is why a tolerance below 1e-7 would mean nothing here.
      const SymmetricEigen eigen(-0.5 * (gram + gram.transpose()));
      const Eigen::VectorXd values = (-eigen.eigenvalues()).cwiseMax(0);
      count_rank(values.cwiseSqrt(), options.rank_tolerance);
      const auto vectors = eigen.eigenvectors().leftCols(rank_);
      inverse_ = vectors * values.head(rank_).cwiseInverse().asDiagonal() * vectors.transpose();
    }
  }

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] double condition() const { return condition_; }

  /// @param y  9m
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& y) const {
    return inverse_ * (tets_ == ProjectionTets::kCubature ? cubature_values(y) : transposed(y));
  }
  /// Norm of y (9m), as the fit measures it.
  [[nodiscard]] double norm(const Eigen::VectorXd& y) const {
    if (tets_ == ProjectionTets::kCubature) return cubature_values(y).norm();
    return volume_norm(gradient_, y);
  }
  /// Norm of y - Q W-hat z.
  [[nodiscard]] double left(const Eigen::VectorXd& y, const Eigen::VectorXd& z) const {
    if (tets_ == ProjectionTets::kCubature) return (cubature_values(y) - rs_modes_ * z).norm();
    return norm(y - linear_coordinates(gradient_, modes_ * z));
  }

 private:
  void count_rank(const Eigen::VectorXd& singular, double tolerance) {
    while (rank_ < singular.size() && singular[rank_] > tolerance * singular[0]) ++rank_;
    condition_ = rank_ > 0 ? singular[0] / singular[rank_ - 1] : 0;
  }
  [[nodiscard]] Eigen::VectorXd cubature_values(const Eigen::VectorXd& y) const {
    Eigen::VectorXd result(kRsSize * Eigen::Index{model_.cubature_size()});
    for (int t = 0; t < model_.cubature_size(); ++t) {
      result.segment<kRsSize>(kRsSize * Eigen::Index{t}) =
          y.segment<kRsSize>(kRsSize * Eigen::Index{model_.tets[t]});
    }
    return result;
  }
  /// (Q W-hat)^T V y.
  [[nodiscard]] Eigen::VectorXd transposed(const Eigen::VectorXd& y) const {
    Eigen::VectorXd g(y.size()), f;
    for (Eigen::Index e = 0; e < gradient_.tet_count(); ++e) {
      // Rotations and shears take half of each of two entries.
      RsVector part = y.segment<kRsSize>(kRsSize * e);
      part.head<3>() *= 0.5;
      part.tail<3>() *= 0.5;
      Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * e) = linear_gradient(part);
    }
    gradient_.apply_transposed_weighted(g, f);
    return modes_.transpose() * f;
  }

  const bodies::GradientOperator& gradient_;
  const ReducedModel& model_;
  ProjectionTets tets_;
  Eigen::MatrixXd modes_, rs_modes_;  // without translations
  Eigen::MatrixXd inverse_;
  int rank_ = 0;
  double condition_ = 0;
};

void require_size(Eigen::Index rows, const ReducedModel& model, const char* field) {
  if (rows != 3 * Eigen::Index{model.node_count}) {
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} have {} rows, the model's {} nodes need {}", field, rows,
                            model.node_count, 3 * model.node_count));
  }
}

void require_finite(const Eigen::Ref<const Eigen::MatrixXd>& poses, const char* field) {
  for (Eigen::Index k = 0; k < poses.cols(); ++k) {
    if (!poses.col(k).allFinite()) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("{}[{}]", field, k),
                  fmt::format("{}[{}] has a displacement that is not finite", field, k));
    }
  }
}

enum class Tracking { kInTime, kPoseAlone };

constexpr Eigen::Index kPosesAtOnce = 8;  // of one batch

/// The contribution of the base motion to a pose.
struct BasePose {
  Eigen::VectorXd y;  // 9m
  Eigen::Vector3d mean;
  Eigen::VectorXd displacements;  // 3n; empty: there is none
};

/// Largest difference of the gradients of two displacements that are the same.
constexpr double kSameGradient = 1e-7;

}  // namespace

void ProjectionOptions::validate() const {
  if (!(rank_tolerance > 0 && rank_tolerance < 1)) {
    throw Error(
        ErrorCode::kInvalidArgument, "rank_tolerance",
        fmt::format("ProjectionOptions::rank_tolerance = {}, must be in (0, 1)", rank_tolerance));
  }
  if (corrections < 0) {
    throw Error(ErrorCode::kInvalidArgument, "corrections",
                fmt::format("ProjectionOptions::corrections = {}, must be >= 0", corrections));
  }
}

class ModalProjector::Impl {
 public:
  Impl(const bodies::ElasticBody& body, const ReducedModel& model, const ProjectionOptions& options)
      : model_(model),
        body_(body),
        options_(checked(body, model, options)),
        gradient_(body.mesh),
        inverse_(body, gradient_),
        fit_(gradient_, model, options) {
    if (translations(model) > 0) {
      mass_share_ = bodies::lumped_node_mass(body.mesh);
      mass_share_ /= mass_share_.sum();
    }
  }

  [[nodiscard]] ModalProjection project(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                        Tracking tracking, const JobContext& job) const {
    check_poses(poses);
    ModalProjection result = empty(poses.cols());
    const BasePose rest{Eigen::VectorXd::Zero(kRsSize * Eigen::Index{gradient_.tet_count()}),
                        Eigen::Vector3d::Zero(),
                        {}};
    const auto project_one = [&](Eigen::Index k, RsTrack& track) {
      const Eigen::VectorXd y = smooth_coordinates(inverse_, poses.col(k), track);
      fit(k, poses.col(k), y, rest, track, result);
    };
    // Poses at the same time where none waits for another, else the tets of each.
    const bool alone = tracking == Tracking::kPoseAlone;
    const Eigen::Index batch = alone && poses.cols() >= kPosesAtOnce ? kPosesAtOnce : 1;
    RsTrack track;
    for (Eigen::Index k = 0; k < poses.cols(); k += batch) {
      job.report("projecting poses", static_cast<double>(k) / static_cast<double>(poses.cols()));
      if (batch == 1) {
        if (alone) track = {};
        project_one(k, track);
        continue;
      }
      parallel_for(std::min(batch, poses.cols() - k), 1, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          RsTrack own;
          project_one(k + i, own);
        }
      });
    }
    return result;
  }

  [[nodiscard]] TrackedBase track(Eigen::MatrixXd motion) const {
    require_size(motion.rows(), model_, "base_motion");
    require_finite(motion, "base_motion");
    return {inverse_, std::move(motion)};
  }

  [[nodiscard]] ModalProjection project(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                        const std::vector<int>& frames, TrackedBase& tracked_base,
                                        const JobContext& job) const {
    check_poses(poses);
    check(frames, tracked_base.motion().cols(), poses.cols());
    ModalProjection result = empty(poses.cols());
    Eigen::Matrix3Xd offset = Eigen::Matrix3Xd::Zero(3, gradient_.tet_count());
    for (Eigen::Index k = 0; k < poses.cols(); ++k) {
      job.report("projecting keyframes",
                 static_cast<double>(k) / static_cast<double>(poses.cols()));
      const int frame = frames[static_cast<std::size_t>(k)];
      const TrackedBase::Pose& at = tracked_base.at(frame, job);
      const BasePose base{at.y, mean(tracked_base.motion().col(frame)),
                          tracked_base.motion().col(frame)};
      const KeyframePose pose = tracked(poses.col(k), at, offset);
      offset = pose.track.counted - at.after.counted;
      fit(k, poses.col(k), pose.y, base, pose.track, result);
    }
    return result;
  }

  /// A held body's fixed nodes tell more than a keyframe long before.
  [[nodiscard]] Tracking keyframe_tracking() const {
    return translations(model_) > 0 ? Tracking::kInTime : Tracking::kPoseAlone;
  }

 private:
  static ProjectionOptions checked(const bodies::ElasticBody& body, const ReducedModel& model,
                                   const ProjectionOptions& options) {
    options.validate();
    if (body.mesh.node_count() != model.node_count) {
      throw Error(ErrorCode::kInvalidArgument, "body",
                  fmt::format("the body has {} nodes, the model {}", body.mesh.node_count(),
                              model.node_count));
    }
    return options;
  }

  void check_poses(const Eigen::Ref<const Eigen::MatrixXd>& poses) const {
    require_size(poses.rows(), model_, "poses");
    require_finite(poses, "poses");
  }

  static void check(const std::vector<int>& frames, Eigen::Index base_frames, Eigen::Index poses) {
    if (static_cast<Eigen::Index>(frames.size()) != poses) {
      throw Error(ErrorCode::kInvalidArgument, "frames",
                  fmt::format("{} frames for {} poses", frames.size(), poses));
    }
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const int frame = frames[k];
      const std::string field = fmt::format("frames[{}]", k);
      if (frame < 0 || frame >= base_frames) {
        throw Error(ErrorCode::kOutOfRange, field,
                    fmt::format("{} = {}, the base motion has frames 0 to {}", field, frame,
                                base_frames - 1));
      }
      if (k > 0 && frame <= frames[k - 1]) {
        throw Error(ErrorCode::kInvalidArgument, field,
                    fmt::format("{} = {} does not ascend", field, frame));
      }
    }
  }

  [[nodiscard]] ModalProjection empty(Eigen::Index poses) const {
    const Eigen::Index rows = kRsSize * Eigen::Index{gradient_.tet_count()};
    return {Eigen::MatrixXd::Zero(model_.coordinate_count(), poses),
            Eigen::VectorXd::Zero(poses),
            fit_.rank(),
            fit_.condition(),
            options_.rest == ProjectionRest::kKept ? Eigen::MatrixXf::Zero(rows, poses)
                                                   : Eigen::MatrixXf(),
            Eigen::VectorXd::Zero(options_.rest == ProjectionRest::kKept ? poses : 0),
            {}};
  }

  [[nodiscard]] Eigen::Vector3d mean(const Eigen::Ref<const Eigen::VectorXd>& u) const {
    if (mass_share_.size() == 0) return Eigen::Vector3d::Zero();
    return Eigen::Map<const Eigen::Matrix3Xd>(u.data(), 3, mass_share_.size()) * mass_share_;
  }

  struct KeyframePose {
    Eigen::VectorXd y;  // 9m
    RsTrack track;
  };

  /// A keyframe over a base motion. A free body's turns continue from the base's, as the keyframe
  /// before had them. A held body's turns are counted from its fixed nodes or from the base's; the
  /// modes select the better fit. Near full turns the first count alone may not reproduce the
  /// base's own pose.
  [[nodiscard]] KeyframePose tracked(const Eigen::Ref<const Eigen::VectorXd>& pose,
                                     const TrackedBase::Pose& base,
                                     const Eigen::Matrix3Xd& offset) const {
    KeyframePose on_base;
    const bool is_free = keyframe_tracking() == Tracking::kInTime;
    if (is_free) {
      on_base.track.counted = base.after.counted + offset;
    } else {
      on_base.track = base.before;  // as the base's own pose was tracked
    }
    on_base.y = smooth_coordinates(inverse_, pose, on_base.track);
    if (is_free) return on_base;
    KeyframePose alone;
    alone.y = smooth_coordinates(inverse_, pose, alone.track);
    const auto left = [&](const Eigen::VectorXd& y) {
      const Eigen::VectorXd difference = y - base.y;
      return fit_.left(difference, fit_.solve(difference));
    };
    return left(on_base.y) < left(alone.y) ? on_base : alone;
  }

  /// Column k of the result from the pose's RS coordinates y.
  void fit(Eigen::Index k, const Eigen::Ref<const Eigen::VectorXd>& pose, const Eigen::VectorXd& y,
           const BasePose& base, const RsTrack& track, ModalProjection& result) const {
    const int fixed = translations(model_);
    const Eigen::VectorXd difference = y - base.y;
    Eigen::VectorXd z = fit_.solve(difference);
    const double size = fit_.norm(difference);
    result.error[k] = size > 0 ? fit_.left(difference, z) / size : 0;
    if (options_.corrections > 0) correct(y, base, track, z);
    result.z.col(k).tail(z.size()) = z;
    const Eigen::VectorXd linear = model_.modes.rightCols(z.size()) * z;
    if (options_.rest == ProjectionRest::kKept) {
      const Eigen::VectorXd rest = difference - linear_coordinates(gradient_, linear);
      result.rest.col(k) = rest.cast<float>();
      result.rest_size[k] = volume_norm(gradient_, rest) / std::sqrt(gradient_.volumes().sum());
      if (!have_gradients_of(y, pose)) keep_beyond(k, pose, y, base, result);
    }
    if (fixed == 0) return;
    result.z.col(k).head<3>() = (mean(pose) - base.mean - mean(linear)) / model_.length;
  }

  /// Whether g(y) = G u.
  [[nodiscard]] bool have_gradients_of(const Eigen::VectorXd& y,
                                       const Eigen::Ref<const Eigen::VectorXd>& u) const {
    for (int e = 0; e < gradient_.tet_count(); ++e) {
      const RsVector part = y.segment<kRsSize>(kRsSize * Eigen::Index{e});
      const Eigen::Matrix3d difference = displacement_gradient(part) - gradient_.apply(u, e);
      if (!(difference.cwiseAbs().maxCoeff() <= kSameGradient)) return false;
    }
    return true;
  }

  void keep_beyond(Eigen::Index k, const Eigen::Ref<const Eigen::VectorXd>& pose,
                   const Eigen::VectorXd& y, const BasePose& base, ModalProjection& result) const {
    Eigen::VectorXd left = pose - full().from_coordinates(y).col(0);
    if (base.displacements.size() > 0) {
      const Eigen::MatrixXd lift = full().lift(base.displacements, body_.fixed_nodes);
      if (lift.size() > 0) left -= lift.col(0);
    }
    left.reshaped(3, left.size() / 3).colwise() -= mean(pose);
    for (const int node : body_.fixed_nodes) left.segment<3>(3 * Eigen::Index{node}).setZero();
    const std::lock_guard lock(mutex_);  // poses may be projected at the same time
    if (result.beyond.size() == 0) result.beyond.setZero(pose.size(), result.z.cols());
    result.beyond.col(k) = left;
  }

  /// Made when it is first needed: it factors the body's Laplacian.
  [[nodiscard]] const FullReconstruction& full() const {
    std::call_once(full_once_, [&] { full_.emplace(body_); });
    return *full_;
  }

  void correct(const Eigen::VectorXd& y, const BasePose& base, const RsTrack& track,
               Eigen::VectorXd& z) const {
    const auto missing = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      const Eigen::VectorXd linear =
          base.y + linear_coordinates(gradient_, model_.modes.rightCols(at.size()) * at);
      RsTrack near = track;
      return y - smooth_coordinates(inverse_, full().from_coordinates(linear).col(0), near);
    };
    Eigen::VectorXd miss = missing(z), step = fit_.solve(miss);
    for (int round = 0; round < options_.corrections; ++round) {
      const Eigen::VectorXd candidate = z + step;
      const Eigen::VectorXd left = missing(candidate), next = fit_.solve(left);
      // The part that modes can make is what a correction is about: the rest of the miss stays.
      if (!(next.norm() < step.norm())) return;
      z = candidate;
      step = next;
    }
  }

  const ReducedModel& model_;
  const bodies::ElasticBody& body_;
  ProjectionOptions options_;
  bodies::GradientOperator gradient_;
  RsInverse inverse_;
  Fit fit_;
  Eigen::VectorXd mass_share_;  // n, sums to one; empty for a held body
  mutable std::once_flag full_once_;
  mutable std::optional<FullReconstruction> full_;
  mutable std::mutex mutex_;
};

ModalProjector::ModalProjector(const bodies::ElasticBody& body, const ReducedModel& model,
                               const ProjectionOptions& options)
    : impl_(std::make_unique<const Impl>(body, model, options)) {}
ModalProjector::~ModalProjector() = default;

bool ModalProjector::keyframes_are_independent() const {
  return impl_->keyframe_tracking() == Tracking::kPoseAlone;
}

ModalProjection ModalProjector::motion(const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                       const JobContext& job) const {
  return impl_->project(displacements, Tracking::kInTime, job);
}

ModalProjection ModalProjector::keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const JobContext& job) const {
  return impl_->project(poses, impl_->keyframe_tracking(), job);
}

ModalProjection ModalProjector::keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const KeyframesOnBase& base,
                                          const JobContext& job) const {
  TrackedBase tracked = impl_->track(base.base_motion);
  return impl_->project(poses, base.frames, tracked, job);
}

TrackedBase ModalProjector::track(Eigen::MatrixXd base_motion) const {
  return impl_->track(std::move(base_motion));
}

ModalProjection ModalProjector::keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const std::vector<int>& frames, TrackedBase& base,
                                          const JobContext& job) const {
  return impl_->project(poses, frames, base, job);
}

}  // namespace limber::reduced
