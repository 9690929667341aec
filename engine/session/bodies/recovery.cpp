#include "engine/session/bodies/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/clauses.h"
#include "engine/base/error.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/modal_projection.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {
namespace {

constexpr int kLeastFrames = 8;  // that are not driven
/// Modal coordinates [body lengths] below this are what numbers leave of none.
constexpr double kRounding = 1e-9;
/// As a share of the displacements: with a larger remainder, modes cannot represent the motion.
constexpr double kPoorProjection = 0.1;

/// As a share of the displacements: a continuation with a larger error is no prediction.
constexpr double kPoorContinuation = 0.1;

/// Frames that are reconstructed at a time.
constexpr Eigen::Index kChunk = 64;

[[noreturn]] void refuse_recovery(const char* field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

double relative(double difference, double size) {
  if (size > 0) return difference / size;
  return difference > 0 ? 1 : 0;
}

/// |got - wanted| / |wanted| over frames [begin, end), from sums of squares of each.
struct FrameErrors {
  Eigen::VectorXd difference, size;

  explicit FrameErrors(Eigen::Index frames)
      : difference(Eigen::VectorXd::Zero(frames)), size(Eigen::VectorXd::Zero(frames)) {}

  [[nodiscard]] double over(Eigen::Index begin, Eigen::Index end) const {
    if (begin >= end) return 0;
    return relative(std::sqrt(difference.segment(begin, end - begin).sum()),
                    std::sqrt(size.segment(begin, end - begin).sum()));
  }
  /// Error of one frame, which may be one of rest: relative to a hundredth of the largest at least.
  [[nodiscard]] double in(Eigen::Index frame) const {
    return relative(std::sqrt(difference[frame]),
                    std::sqrt(std::max(size[frame], 1e-4 * size.maxCoeff())));
  }
};

/// A body, its candidate modes and its motion.
struct Recoverable {
  MappedBody mapped;
  Eigen::MatrixXd base;                // 3n x N displacements [m]
  reduced::ReducedModel model;         // modes alone: neither basis nor cubature
  reduced::ModalProjection projected;  // z-bar
};

reduced::ReducedModel candidate_modes(const scene::Scene& scene, const bodies::ElasticBody& body,
                                      const JobContext& job) {
  scene::Scene resolved_request;
  resolved_request.model = scene.model;
  resolved_request.material_optimisation.variables = scene::MaterialVariables::kAll;
  bodies::ModalOptions options;
  options.mode_count = map_model(resolved_request, body).mode_count;
  reduced::ScaledModes scaled =
      reduced::scale_modes(body, bodies::modal_analysis(body, options, job));
  reduced::ReducedModel model;
  model.node_count = body.mesh.node_count();
  model.length = body.length();
  model.rigid_count = scaled.rigid_count;
  model.mechanism_count = scaled.mechanism_count;
  model.eigenvalues = std::move(scaled.eigenvalues);
  model.modes = std::move(scaled.modes);
  return model;
}

Recoverable prepare(const scene::Scene& scene, const JobContext& job) {
  job.report("preparing the mesh", 0);
  Recoverable result;
  result.mapped = map_body(scene);
  result.base = map_base_motion(scene, result.mapped.source_of_compact);
  result.model = candidate_modes(scene, result.mapped.body, job.part(0.05, 0.7));
  reduced::ProjectionOptions options;
  options.tets = reduced::ProjectionTets::kAll;
  const JobContext projecting = job.part(0.7, 1);
  projecting.report("projecting the base motion", 0);
  const reduced::ModalProjector projector(result.mapped.body, result.model, options);
  result.projected = projector.motion(result.base, projecting);
  if (!result.projected.z.allFinite())
    throw Error(ErrorCode::kNumerical, "base_motion", "the motion has no modal coordinates");
  auto elastic =
      result.projected.z.bottomRows(result.projected.z.rows() - result.model.rigid_count);
  if (elastic.cwiseAbs().maxCoeff() < kRounding) elastic.setZero();  // a free body in flight
  return result;
}

struct Continued {
  Eigen::MatrixXd z;  // of all candidate modes, rigid ones too; coordinates x frames
  int bounded_modes = 0;
};

/// Elastic coordinates by the material; rigid ones as they were seen, then at a steady velocity.
Continued continue_motion(const Recoverable& from, const spacetime::Recovery& recovery, int total) {
  const spacetime::RecoveredMotion& recovered = recovery.motion;
  const Eigen::Index known = recovered.z.cols(), ahead = total - known;
  const Eigen::Index rigid = from.model.rigid_count;
  const auto free = spacetime::continue_freely(recovery, static_cast<int>(ahead));
  Continued result;
  result.bounded_modes = free.bounded_modes;
  result.z.resize(from.projected.z.rows(), total);
  auto elastic = result.z.bottomRows(result.z.rows() - rigid);
  elastic.leftCols(known) = recovered.mixing * recovered.z;
  elastic.rightCols(ahead) = recovered.mixing * free.z;
  if (rigid == 0) return result;
  const Eigen::MatrixXd projected = from.projected.z.topRows(rigid).leftCols(known);
  result.z.topRows(rigid).leftCols(known) = projected;
  const Eigen::VectorXd velocity = projected.col(known - 1) - projected.col(known - 2);
  for (Eigen::Index i = 0; i < ahead; ++i)
    result.z.col(known + i).head(rigid) =
        projected.col(known - 1) + static_cast<double>(i + 1) * velocity;
  return result;
}

/// Shapes of z, chunk by chunk: take(first frame, displacements 3n x count).
template <class Take>
void reconstruct(const Recoverable& from, const reduced::FullReconstruction& full,
                 const Eigen::MatrixXd& z, const JobContext& job, const Take& take) {
  for (Eigen::Index first = 0; first < z.cols(); first += kChunk) {
    job.report("reconstructing shapes", static_cast<double>(first) / static_cast<double>(z.cols()));
    const Eigen::Index count = std::min(kChunk, z.cols() - first);
    take(first,
         full.from_linear(from.model.modes * z.middleCols(first, count), {job.cancellation, {}}));
  }
}

void compare(const Recoverable& from, Eigen::Index first, const Eigen::MatrixXd& shapes,
             FrameErrors& errors) {
  const Eigen::Index count = std::min(shapes.cols(), from.base.cols() - first);
  for (Eigen::Index i = 0; i < count; ++i) {
    errors.difference[first + i] = (shapes.col(i) - from.base.col(first + i)).squaredNorm();
    errors.size[first + i] = from.base.col(first + i).squaredNorm();
  }
}

/// Lambda, D and S with the rigid motions of a free body first.
void describe_material(const spacetime::RecoveredMotion& recovered, Eigen::Index rigid,
                       RecoveryReport& report) {
  const Eigen::Index modes = recovered.mixing.cols(), coordinates = recovered.mixing.rows();
  report.dynamics = recovered.dynamics;
  report.dynamics.stiffness = Eigen::VectorXd::Zero(rigid + modes);
  report.dynamics.damping = Eigen::VectorXd::Zero(rigid + modes);
  report.dynamics.stiffness.tail(modes) = recovered.dynamics.stiffness;
  report.dynamics.damping.tail(modes) = recovered.dynamics.damping;
  report.mixing = Eigen::MatrixXd::Identity(rigid + coordinates, rigid + modes);
  report.mixing.bottomRightCorner(coordinates, modes) = recovered.mixing;
}

std::string notes(const scene::Scene& scene, const RecoveryReport& report,
                  const std::string& of_recovery, int bounded_modes) {
  std::string result = of_recovery;
  const auto note = [&](const std::string& text) { append_clause(result, text); };
  if (scene.mesh.materials.size() > 1) {
    note(fmt::format("the candidate modes are those of the {} materials of the mesh",
                     scene.mesh.materials.size()));
  }
  if (bounded_modes > 0) {
    note(
        fmt::format("{} of the recovered modes are too fast for the frames: the continuation "
                    "takes the stiffest that does not grow",
                    bounded_modes));
  }
  if (report.continued_error > kPoorContinuation) {
    note(
        fmt::format("the continuation is off by {:.0f} % in the frames of the base motion behind "
                    "those that it was recovered from (limit {:.0f} %): do not rely on it",
                    100 * report.continued_error, 100 * kPoorContinuation));
  }
  if (report.projection_error > kPoorProjection) {
    note(
        fmt::format("the candidate modes leave {:.0f} % of the base motion: more of them "
                    "(model.candidate_modes) would see more of it",
                    100 * report.projection_error));
  }
  return result;
}

spacetime::RecoveryOptions options_of(const RecoveryRequest& request, int modes) {
  spacetime::RecoveryOptions options;
  options.modes = modes;
  options.variables = request.variables;
  options.start = request.start;
  options.weight = request.weight;
  options.column_weight = request.column_weight;
  options.driven_frames = request.driven_frames;
  return options;
}

}  // namespace

RecoveryRequest RecoveryRequest::resolved(int base_frames) const {
  spacetime::RecoveryOptions options = options_of(*this, 1);
  options.validate();
  RecoveryRequest result = *this;
  if (recovered_frames == 0) result.recovered_frames = base_frames / 2;
  if (total_frames == 0) result.total_frames = base_frames;
  const int frames = result.recovered_frames;
  if (frames - kLeastFrames < driven_frames) {
    refuse_recovery(
        "recovered_frames",
        fmt::format("a recovery needs {} frames that are not driven, there are {} frames{} and "
                    "{} of them are driven",
                    kLeastFrames, frames, recovered_frames == 0 ? " (half of the base motion)" : "",
                    driven_frames));
  }
  if (frames > base_frames) {
    refuse_recovery("recovered_frames",
                    fmt::format("{} frames, the base motion has {}", frames, base_frames));
  }
  if (result.total_frames < frames) {
    refuse_recovery("total_frames",
                    fmt::format("{} frames are fewer than the {} that are recovered from",
                                result.total_frames, frames));
  }
  return result;
}

MaterialRecovery recover(const scene::Scene& scene, const RecoveryRequest& request,
                         const JobContext& job) {
  if (scene.base_motion.size() == 0)
    refuse_recovery("base_motion", "the scene has no base motion to recover a material from");
  const RecoveryRequest resolved_request = request.resolved(scene.frame_count);
  const Recoverable from = prepare(scene, job.part(0, 0.5));
  const Eigen::Index rigid = from.model.rigid_count;
  const Eigen::Index elastic = from.model.coordinate_count() - rigid;
  const spacetime::Recovery recovery = spacetime::recover(
      from.projected.z.bottomRows(elastic).leftCols(resolved_request.recovered_frames),
      from.model.eigenvalues.tail(elastic),
      options_of(resolved_request, std::min(scene.model.mode_count, static_cast<int>(elastic))),
      job.part(0.5, 0.7));
  const Continued continued = continue_motion(from, recovery, resolved_request.total_frames);

  MaterialRecovery result;
  result.geometry = rest_geometry(scene, from.mapped);
  result.positions.resize(scene.mesh.nodes.size(), resolved_request.total_frames);
  const reduced::FullReconstruction full(from.mapped.body);
  FrameErrors errors(scene.frame_count), floor(scene.frame_count);
  reconstruct(from, full, continued.z, job.part(0.7, 0.85),
              [&](Eigen::Index first, const Eigen::MatrixXd& shapes) {
                result.positions.middleCols(first, shapes.cols()) =
                    source_positions(scene, from.mapped, shapes);
                if (first < scene.frame_count) compare(from, first, shapes, errors);
              });
  reconstruct(from, full, from.projected.z, job.part(0.85, 1),
              [&](Eigen::Index first, const Eigen::MatrixXd& shapes) {
                compare(from, first, shapes, floor);
              });

  RecoveryReport& report = result.report;
  const int last = std::min(resolved_request.total_frames, scene.frame_count);
  report.recovered_frames = resolved_request.recovered_frames;
  report.frames_per_second = scene.dynamics.frames_per_second;
  describe_material(recovery.swings, rigid, report);
  report.converged = recovery.report.status == spacetime::RecoveryStatus::kConverged;
  report.steps = recovery.report.steps;
  report.energies = recovery.report.energies;
  report.projection_error = floor.over(0, scene.frame_count);
  report.recovered_error = errors.over(0, resolved_request.recovered_frames);
  report.continued_error = errors.over(resolved_request.recovered_frames, last);
  if (last > resolved_request.recovered_frames) report.final_frame_error = errors.in(last - 1);
  report.message = notes(scene, report, recovery.report.message, continued.bounded_modes);
  return result;
}

}  // namespace limber::session
