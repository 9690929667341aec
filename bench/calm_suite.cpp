// How calm motions are by default and as published: a few keys on all samples, the bodies of the
// public data and four others. Lengths are in body lengths L.
//
// `zigzag`: largest distance of a node from the mean of its neighbour frames. `share`: power of
// nodes above half the Nyquist frequency. `overshoot`: of one key, how far its node swings to the
// other side. `least`, `most`: of two equal keys, how far the node is between them, over the key.
// `missed`: largest miss of a key. `swap`: largest change of a node from the last reduced result to
// the exact one. `rate_change`: largest change of a held node's curve from 24 to 48 and from 48 to
// 96 frames a second. `first_ms`, `final_ms`: from the edit with all keys to the first and the
// final result.
//
// Keys are 0.1 to 0.3 L away, on nodes far from the fixed ones; 5 s at 24 frames a second, default
// settings. `--quick`: bodies of up to 4,000 tets. `$LIMBER_BENCH_ONLY`: bodies whose names contain
// it.
#include <fmt/core.h>

#include <map>

#include "bench/public_body.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/samples/samples.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "engine/session/bodies/session.h"
#include "tests/support/material_bodies.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

using Eigen::Index;
using session::BodyResult;
using ResultPointer = std::shared_ptr<const BodyResult>;

constexpr int kMostQuickTets = 4'000;
constexpr double kSeconds = 5, kSwing = 40.0 / 30;  // of a scene; of the lowest swing
constexpr int kSlowestRate = 24;                    // [frames/s]
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

enum class Keys { kOne = 1, kTwoEqual = 2, kThree = 3, kFive = 5 };
enum class Form { kCalm, kPublished };

struct Task {
  Keys keys;
  bool is_exact;
  [[nodiscard]] std::string name() const {
    return fmt::format("{}{}, {}", static_cast<int>(keys), keys == Keys::kTwoEqual ? " equal" : "",
                       is_exact ? "exact" : "soft");
  }
};

/// A body of round limbs.
std::optional<scene::Scene> limbs(const std::string& name, const Eigen::Matrix3Xd& starts,
                                  const Eigen::Matrix3Xd& ends, double radius) {
  scene::ImplicitSolid solid;
  solid.distance = [=](const Eigen::Vector3d& at) {
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < starts.cols(); ++i) {
      const Eigen::Vector3d along = ends.col(i) - starts.col(i);
      const double share =
          std::clamp((at - starts.col(i)).dot(along) / along.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (at - starts.col(i) - share * along).norm() - radius);
    }
    return least;
  };
  for (const Eigen::Matrix3Xd& points : {starts, ends})
    for (const auto& point : points.colwise()) solid.bounds.extend(Eigen::Vector3d(point));
  solid.bounds.min().array() -= 1.1 * radius;
  solid.bounds.max().array() += 1.1 * radius;
  scene::TetrahedralizeOptions options;
  options.target_tets = 3'000;
  scene::Scene scene;
  scene.name = name;
  scene.mesh = scene::tetrahedralize(solid, options).mesh;
  scene.fixed_nodes = testing::lowest_nodes(scene.mesh);
  return scene;
}

std::optional<scene::Scene> starfish() {
  Eigen::Matrix3Xd ends(3, 5);
  for (Index i = 0; i < 5; ++i) {
    const double angle = 2 * EIGEN_PI * (static_cast<double>(i) / 5 + 0.25);
    ends.col(i) << std::cos(angle), std::sin(angle), 0;
  }
  return limbs("starfish", Eigen::Matrix3Xd::Zero(3, 5), ends, 0.18);
}

std::optional<scene::Scene> spring() {
  constexpr Index kParts = 48;
  Eigen::Matrix3Xd points(3, kParts + 1);
  for (Index i = 0; i <= kParts; ++i) {
    const double turn = 2 * EIGEN_PI * 2.5 * static_cast<double>(i) / kParts;
    points.col(i) << 0.4 * std::cos(turn), 1.6 * static_cast<double>(i) / kParts,
        0.4 * std::sin(turn);
  }
  return limbs("spring", points.leftCols(kParts), points.rightCols(kParts), 0.1);
}

std::optional<scene::Scene> tree() {
  Eigen::Matrix3Xd starts(3, 6), ends(3, 6);
  starts << 0, 0, 0, 0, 0.5, -0.4, 0, 1, 1, 0.6, 1.5, 1.4, 0, 0, 0, 0, 0.1, 0;
  ends << 0, 0.5, -0.4, 0.1, 0.9, -0.6, 1, 1.5, 1.4, 1, 1.7, 2, 0, 0.1, 0, 0.6, 0.4, -0.3;
  return limbs("tree", starts, ends, 0.1);
}

std::optional<scene::Scene> cow(const std::filesystem::path& data) {
  const auto path = data / "surfaces" / "spot.obj";
  if (!std::filesystem::exists(path)) return std::nullopt;
  scene::TetrahedralizeOptions options;
  options.target_tets = 4'000;
  options.within = 0.05;
  scene::Scene scene;
  scene.name = "cow";
  scene.mesh = scene::tetrahedralize(scene::read_surface_file(path), options).mesh;
  scene.fixed_nodes = testing::lowest_nodes(scene.mesh);
  return scene;
}

class Results final : public session::BodyListener {
 public:
  void on_progress(const session::Progress& /*progress*/) override {}
  void on_state(session::State /*state*/, const std::string& /*message*/) override {}
  void on_result(const ResultPointer& result) override {
    const auto now = std::chrono::steady_clock::now();
    if (!first) first = now;
    if (result->is_final && !final) final = now;
    (result->is_exact || result->is_final ? exact : reduced) = result;
    newest = result;
  }
  void begin() { first = final = {}, reduced = exact = newest = nullptr; }
  std::optional<std::chrono::steady_clock::time_point> first, final;
  ResultPointer reduced, exact, newest;
};

double milliseconds_between(std::chrono::steady_clock::time_point begin,
                            std::chrono::steady_clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

/// Result of one solve of a task.
struct Motion {
  double zigzag = kNone, share = kNone, swap = kNone, missed = 0, first_ms = 0, final_ms = 0;
  std::string status, message;
  std::vector<Eigen::Matrix3Xd> curves;  // displacements of held nodes [L], 3 x frames
  std::vector<int> frames;               // of keys
  std::vector<Eigen::Vector3d> targets;  // [L]
};

class CalmSuite {
 public:
  CalmSuite(const SuiteOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder) {}

  void run(const scene::Scene& body) {
    if (!is_selected(body.name)) return;
    if (options_.quick && body.mesh.tet_count() > kMostQuickTets)
      return recorder_.note("calm: " + body.name + " left out by --quick");
    recorder_.note(fmt::format("calm: {}, {} tets", body.name, body.mesh.tet_count()));
    for (const bool is_exact : {false, true})
      for (const Keys keys : {Keys::kOne, Keys::kTwoEqual, Keys::kThree, Keys::kFive})
        run_task(body, {keys, is_exact});
  }

 private:
  void run_task(const scene::Scene& body, const Task& task) {
    std::map<Form, Motion> motions;
    for (const Form form : {Form::kCalm, Form::kPublished}) {
      std::vector<Motion> rates;
      try {
        for (const int rate : {kSlowestRate, 2 * kSlowestRate, 4 * kSlowestRate})
          rates.push_back(solve(body, task, form, rate));
      } catch (const Error& error) {
        return recorder_.note(
            fmt::format("calm: {}, {}: {}", body.name, task.name(), error.what()));
      }
      add(body, task, form, rates);
    }
  }

  void add(const scene::Scene& body, const Task& task, Form form,
           const std::vector<Motion>& rates) {
    const Motion& motion = rates[0];
    Case result;
    result["scene"] = body.name;
    result["tets"] = body.mesh.tet_count();
    result["keys"] = task.name();
    result["form"] = form == Form::kCalm ? "calm" : "published";
    result["zigzag"] = motion.zigzag;
    result["share"] = motion.share;
    result["overshoot"] = task.keys == Keys::kOne ? overshoot(motion) : kNone;
    const auto [least, most] =
        task.keys == Keys::kTwoEqual ? between(motion) : std::pair<double, double>(kNone, kNone);
    result["least"] = least;
    result["most"] = most;
    result["missed"] = motion.missed;
    result["swap"] = motion.swap;
    result["rate_change_24_48"] = change(rates[0], rates[1]);
    result["rate_change_48_96"] = change(rates[1], rates[2]);
    result["first_ms"] = motion.first_ms;
    result["final_ms"] = motion.final_ms;
    result["status"] = motion.status;
    result["says_so"] = motion.message.find("shakes") != std::string::npos ||
                        motion.message.find("abrupt") != std::string::npos;
    recorder_.add(result);
  }

  /// Along the key, below zero.
  static double overshoot(const Motion& motion) {
    const Eigen::RowVectorXd along = motion.targets[0].normalized().transpose() * motion.curves[0];
    return std::max(0.0, -along.minCoeff());
  }

  static std::pair<double, double> between(const Motion& motion) {
    const Index first = motion.frames[0];
    const Eigen::RowVectorXd along =
        motion.targets[0].transpose() / motion.targets[0].squaredNorm() *
        motion.curves[0].middleCols(first, motion.frames[1] - first + 1);
    return {along.minCoeff(), along.maxCoeff()};
  }

  static double change(const Motion& slow, const Motion& fast) {
    double most = 0;
    for (std::size_t i = 0; i < slow.curves.size(); ++i)
      for (Index frame = 0; frame < slow.curves[i].cols(); ++frame)
        most = std::max(most, (slow.curves[i].col(frame) - fast.curves[i].col(2 * frame)).norm());
    return most;
  }

  /// Scenes of the same motion in seconds at any rate, without its keys.
  static scene::Scene at_rate(const scene::Scene& body, Form form, int rate) {
    scene::Scene scene;
    scene.name = body.name;
    scene.mesh = body.mesh;
    scene.material = body.material;
    scene.merge_tolerance = body.merge_tolerance;
    scene.fixed_nodes = body.fixed_nodes;
    scene.frame_count = static_cast<int>(kSeconds) * rate + 1;
    scene.dynamics.frames_per_second = rate;
    scene.dynamics.period_frames = kSwing * rate;
    if (form == Form::kPublished) {
      scene.dynamics.discretisation = scene::Discretisation::kDifferences;
      scene.dynamics.damping_ratio = scene.dynamics.force_smoothing = 0;
    }
    return scene;
  }

  Motion solve(const scene::Scene& body, const Task& task, Form form, int rate) {
    const scene::Scene scene = at_rate(body, form, rate);
    const auto results = std::make_shared<Results>();
    session::BodySession session(
        "calm", scene, {}, cache_, [](const std::function<void()>& work) { work(); }, results);
    if (session.state() != session::State::kReady)
      throw Error(ErrorCode::kInternal, "", session.state_message());
    const double length = session.model()->length / scene.length_unit_in_metres;
    Motion motion;
    std::vector<session::BodyEdit> edits;
    const int count = static_cast<int>(task.keys);
    const std::vector<int> nodes = testing::far_nodes(scene, std::min(count, 3));
    Random random(43);
    for (int i = 0; i < count; ++i) {
      scene::Constraint key;
      // At whole frames of every rate.
      key.frame =
          (i + 1) * static_cast<int>(kSeconds) * kSlowestRate / (count + 1) * (rate / kSlowestRate);
      key.nodes = {nodes[static_cast<std::size_t>(i) % nodes.size()]};
      Eigen::Vector3d direction;
      for (double& value : direction) value = random.normal();
      direction = random.uniform(0.1, 0.3) * direction.normalized();
      if (task.keys == Keys::kTwoEqual) {
        key.nodes = {nodes[0]};
        if (i == 1) direction = motion.targets[0];
      }
      key.target = length * direction;
      key.weight = task.is_exact ? std::numeric_limits<double>::infinity() : 100;
      motion.frames.push_back(key.frame);
      motion.targets.push_back(direction);
      edits.emplace_back(session::AddConstraint{key});
    }
    results->begin();
    const auto begin = std::chrono::steady_clock::now();
    session.edit(edits);
    if (!results->final || results->newest->solve_failed)
      throw Error(ErrorCode::kNumerical, "", "the solve failed");
    motion.first_ms = milliseconds_between(begin, *results->first);
    motion.final_ms = milliseconds_between(begin, *results->final);
    measure(session, *results, scene, length, motion);
    for (const session::BodyEdit& edit : edits) {
      const int node = std::get<session::AddConstraint>(edit).constraint.nodes[0];
      motion.curves.push_back(curve(session, *results->newest, scene, node) / length);
    }
    return motion;
  }

  static Eigen::Matrix3Xd curve(const session::BodySession& session, const BodyResult& result,
                                const scene::Scene& scene, int node) {
    const Eigen::MatrixXd positions = session.positions(result, 0, scene.frame_count);
    return positions.middleRows(3 * node, 3).colwise() - scene.mesh.nodes.col(node);
  }

  static void measure(const session::BodySession& session, const Results& results,
                      const scene::Scene& scene, double length, Motion& motion) {
    const BodyResult& result = *results.newest;
    motion.share = result.high_frequency_share.value_or(kNone);
    motion.message = result.report.message;
    motion.missed = result.report.max_constraint_error / session.model()->length;
    motion.status =
        result.report.status == spacetime::SolveStatus::kConverged ? "converged" : "not converged";
    const Eigen::MatrixXd shown = session.positions(result, 0, scene.frame_count);
    const Index inner = shown.cols() - 2;
    motion.zigzag = farthest(shown.middleCols(1, inner) -
                             0.5 * (shown.leftCols(inner) + shown.rightCols(inner))) /
                    length;
    if (results.reduced) {
      motion.swap =
          farthest(shown - session.positions(*results.reduced, 0, scene.frame_count)) / length;
    }
  }

  static double farthest(const Eigen::MatrixXd& moves) {
    return moves.reshaped(3, moves.size() / 3).colwise().norm().maxCoeff();
  }

  const SuiteOptions& options_;
  Recorder& recorder_;
  TemporaryFolder folder_;
  std::shared_ptr<session::ModelCache> cache_ =
      std::make_shared<session::ModelCache>(folder_.path());
};

}  // namespace

void calm_suite(const SuiteOptions& options, Recorder& recorder) {
  CalmSuite suite(options, recorder);
  for (const std::string& name : scene::sample_names()) suite.run(scene::make_sample(name));
  const auto data = std::filesystem::path(options.shared_folder) / "data";
  for (const auto& body : {starfish(), spring(), tree(), cow(data)})
    if (body) suite.run(*body);
  for (const testing::BodyFile& file : testing::public_bodies()) {
    if (!is_selected(file.name)) continue;
    if (const auto body = public_body(file, "calm", kMostQuickTets, options, recorder))
      suite.run(*body);
  }
}

}  // namespace limber::bench
