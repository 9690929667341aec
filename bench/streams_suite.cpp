// Bytes of a frame on the wire against the error of a client's picture, with the bytes that a
// client has to fetch once, on held-out poses. Sizes are of whole messages `Frames` of 100 frames,
// as the server encodes them. `error`: mean over poses of the displacement's difference from full
// rotation-strain shapes of the same z, relative. Our knob is the tolerance that the model is built
// to: coordinates of a better model are longer. The alternatives send positions of the model of 1
// %, in single precision or quantised, full shapes in single precision, or the modal coordinates of
// linear modes.
#include <fmt/core.h>

#include "bench/suite.h"
#include "engine/base/random.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/reduced_model.h"
#include "server/wire/frames.h"

namespace limber::bench {
namespace {

constexpr int kSentFrames = 100;

/// Poses that are sent, and their expected appearance.
struct SentPoses {
  const bodies::ElasticBody& body;
  Eigen::VectorXf rest;  // 3n
  Eigen::MatrixXd z, full;
};

double mean_relative_error(const Eigen::MatrixXd& u, const Eigen::MatrixXd& full) {
  return ((u - full).colwise().norm().array() / full.colwise().norm().array()).mean();
}

server::proto::Frames message_of(server::proto::Encoding encoding) {
  return server::frames_of({}, encoding, {0, kSentFrames});
}

/// Displacements of positions as a client reads them.
Eigen::MatrixXd drawn(const server::proto::Frames& frames, const SentPoses& poses) {
  const Eigen::Index rows = poses.rest.size();
  Eigen::MatrixXf positions(rows, kSentFrames);
  const std::string& bytes = frames.data().data();
  if (frames.encoding() == server::proto::ENCODING_POSITIONS) {
    std::memcpy(positions.data(), bytes.data(), bytes.size());
  } else {
    std::vector<std::uint16_t> levels(static_cast<std::size_t>(positions.size()));
    std::memcpy(levels.data(), bytes.data(), bytes.size());
    const Eigen::Vector3d low(frames.origin().x(), frames.origin().y(), frames.origin().z());
    const Eigen::Vector3d extent(frames.extent().x(), frames.extent().y(), frames.extent().z());
    for (Eigen::Index i = 0; i < positions.size(); ++i) {
      positions.data()[i] = static_cast<float>(
          low[i % 3] + extent[i % 3] * levels[static_cast<std::size_t>(i)] / 65535.0);
    }
  }
  positions.colwise() -= poses.rest;
  return positions.cast<double>();
}

void run_streams(const std::string& name, const bodies::ElasticBody& body, Recorder& recorder) {
  const auto add = [&](const char* method, double tolerance, const server::proto::Frames& frames,
                       double once, double error) {
    Case row;
    row["scene"] = name;
    row["method"] = method;
    row["tolerance"] = tolerance > 0 ? Case(tolerance) : Case(nullptr);
    row["bytes_per_frame"] = static_cast<double>(frames.ByteSizeLong()) / kSentFrames;
    row["bytes_once"] = once;
    row["error"] = error;
    recorder.add(row);
  };
  SentPoses poses{body, {}, {}, {}};
  poses.rest = Eigen::Map<const Eigen::VectorXd>(body.mesh.nodes.data(), body.mesh.nodes.size())
                   .cast<float>();
  const double nodes = body.mesh.node_count();
  for (const double tolerance : {0.1, 0.03, 0.01, 0.003, 0.001}) {
    recorder.note(fmt::format("streams: {}, tolerance {}", name, tolerance));
    reduced::ModelOptions options;
    options.tolerance = tolerance;
    const auto model =
        std::make_shared<const reduced::ReducedModel>(reduced::build_model(body, options));
    if (poses.z.size() == 0) {
      Random random(20241);
      poses.z = reduced::sample_poses(
          {model->eigenvalues, model->modes, model->rigid_count, model->mechanism_count},
          model->length, options.amplitude, reduced::PoseLevels::kTest, kSentFrames, random);
      poses.full = reduced::FullReconstruction(body).from_linear(model->modes * poses.z);
    }
    Eigen::MatrixXf q;
    reduced::ReducedKinematics(model).coordinates(0, poses.z, q);
    const Eigen::MatrixXf basis = model->basis.cast<float>();
    server::proto::Frames frames = message_of(server::proto::ENCODING_COORDINATES);
    server::set_coordinates(q, frames);
    add("limber, coordinates", tolerance, frames, 12 * nodes * static_cast<double>(basis.cols()),
        mean_relative_error((basis * q).cast<double>(), poses.full));
    if (tolerance != 0.01) continue;
    for (const auto& [encoding, method] :
         {std::pair{server::proto::ENCODING_POSITIONS, "positions, single"},
          std::pair{server::proto::ENCODING_POSITIONS_QUANTISED, "positions, quantised"}}) {
      frames = message_of(encoding);
      server::set_positions((basis * q).colwise() + poses.rest, encoding, frames);
      add(method, tolerance, frames, 0, mean_relative_error(drawn(frames, poses), poses.full));
    }
    frames = message_of(server::proto::ENCODING_POSITIONS);
    server::set_positions(poses.full.cast<float>().colwise() + poses.rest,
                          server::proto::ENCODING_POSITIONS, frames);
    add("full shapes, single", 0, frames, 0, mean_relative_error(drawn(frames, poses), poses.full));
    frames = message_of(server::proto::ENCODING_COORDINATES);
    server::set_coordinates(poses.z.cast<float>(), frames);
    add("linear modes", 0, frames, 12 * nodes * static_cast<double>(poses.z.rows()),
        mean_relative_error(model->modes * poses.z, poses.full));
  }
}

}  // namespace

void streams_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const char* name : {"flower", "dino"}) {
    if (options.quick && std::string_view(name) != "flower") {
      recorder.note(fmt::format("streams: {} left out by --quick", name));
      continue;
    }
    if (const auto named = load_body(name, options)) run_streams(name, named->body, recorder);
  }
}

}  // namespace limber::bench
