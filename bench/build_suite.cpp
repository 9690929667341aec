// Cost of a first visit: a model built to a mean error of 1 % on held-out poses, from a mesh in
// memory. Also how soon a session that opens it shows a first picture (`first_picture_ms`) and its
// first final result (`first_final_ms`). Its scene has one node that is moved aside.
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "bench/bar_body.h"
#include "bench/cpu_time.h"
#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"
#include "engine/session/bodies/session.h"

namespace limber::bench {
namespace {

constexpr const char* kBar = "bar";  // bar_body.h, 88,434 tets
constexpr int kBarCells = 17;

std::optional<NamedBody> load(const std::string& name, const SuiteOptions& options) {
  if (name == kBar) return NamedBody{name, bar_body(kBarCells), {}};
  return load_body(name, options);
}

struct BuildCost {
  double build_s = 0, cpu_s = 0, peak_mb = 0, error_mean = 0, error_max = 0, modes_s = 0,
         poses_s = 0, basis_s = 0, cubature_s = 0;
  double first_picture_ms = 0, first_final_ms = 0;
  int tets = 0, basis = 0, cubature_tets = 0, met_tolerance = 0;
};

scene::Scene scene_of(const NamedBody& named) {
  const bodies::TetMesh& mesh = named.body.mesh;
  scene::Scene scene;
  scene.name = named.name;
  scene.mesh = mesh;
  scene.mesh.materials.clear();
  scene.mesh.tet_material.clear();
  scene.fixed_nodes = named.body.fixed_nodes;
  scene.frame_count = 60;
  // The node farthest from the held ones, by a tenth of the body's length.
  const Eigen::Vector3d held = mesh.nodes.col(named.body.fixed_nodes.front());
  Eigen::Index farthest = 0;
  (mesh.nodes.colwise() - held).colwise().squaredNorm().maxCoeff(&farthest);
  scene::Constraint constraint;
  constraint.id = 1;
  constraint.frame = 30;
  constraint.nodes = {static_cast<int>(farthest)};
  constraint.kind = scene::TargetKind::kDisplacement;
  constraint.target = {0, 0, 0.1 * named.body.length()};
  scene.constraints = {constraint};
  return scene;
}

/// Times of a session's first results, after the call that opens it.
class Watch final : public session::BodyListener {
 public:
  void on_state(session::State, const std::string&) override {}
  void on_result(const std::shared_ptr<const session::BodyResult>& result) override {
    if (picture_ms_ == 0) picture_ms_ = now();
    if (result->is_final && !is_done_.exchange(true)) final_.set_value(now());
  }
  double wait() { return final_.get_future().get(); }
  [[nodiscard]] double picture_ms() const { return picture_ms_; }

 private:
  [[nodiscard]] double now() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_)
        .count();
  }
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double picture_ms_ = 0;
  std::atomic<bool> is_done_ = false;
  std::promise<double> final_;
};

void open_session(const NamedBody& named, BuildCost& cost) {
  scene::Scene scene = scene_of(named);
  std::mutex mutex;
  std::vector<std::thread> workers;
  const session::Executor executor = [&](std::function<void()> task) {
    const std::lock_guard lock(mutex);
    workers.emplace_back(std::move(task));
  };
  const auto watch = std::make_shared<Watch>();
  {
    session::BodySession session("bench", std::move(scene), {},
                                 std::make_shared<session::ModelCache>(std::filesystem::path()),
                                 executor, watch);
    cost.first_final_ms = watch->wait();
    cost.first_picture_ms = watch->picture_ms();
    session.close();
  }
  for (std::thread& worker : workers) worker.join();
}

BuildCost build_here(const std::string& name, const SuiteOptions& options) {
  const auto named = load(name, options);
  if (!named) throw std::runtime_error("no body " + name);
  reduced::ReducedModel model;
  BuildCost built;
  const double cpu = process_cpu_seconds();
  built.build_s = 1e-3 * milliseconds([&] { model = reduced::build_model(named->body, {}); });
  built.cpu_s = process_cpu_seconds() - cpu;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  built.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  built.tets = named->body.mesh.tet_count();
  built.basis = model.basis_size();
  built.cubature_tets = model.cubature_size();
  built.error_mean = model.report.error_mean;
  built.error_max = model.report.error_max;
  built.met_tolerance = model.report.met_tolerance ? 1 : 0;
  built.modes_s = model.report.modes_s;
  built.poses_s = model.report.poses_s;
  built.basis_s = model.report.basis_s;
  built.cubature_s = model.report.cubature_s;
  open_session(*named, built);
  return built;
}

/// In a process of its own, so that the peak of memory is this build's.
BuildCost build_aside(const std::string& name, const SuiteOptions& options) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("pipe failed");
  const pid_t child = fork();
  if (child == 0) {
    BuildCost built;
    try {
      built = build_here(name, options);
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      _exit(1);
    }
    const bool written = write(ends[1], &built, sizeof built) == static_cast<ssize_t>(sizeof built);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  BuildCost built;
  const bool whole = read(ends[0], &built, sizeof built) == static_cast<ssize_t>(sizeof built);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!whole || status != 0) throw std::runtime_error("building " + name + " failed");
  return built;
}

}  // namespace

void build_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const std::string name : {"beam", "dino", "bunny", "Armadillo13K", kBar}) {
    if (options.quick && name != "beam" && name != "dino") {
      recorder.note(fmt::format("build: {} left out by --quick", name));
      continue;
    }
    if (!load(name, options)) {
      recorder.note(fmt::format("build: no {} (public data not found)", name));
      continue;
    }
    recorder.note(fmt::format("build: {}", name));
    const BuildCost built = build_aside(name, options);
    Case result;
    result["scene"] = name;
    result["tets"] = built.tets;
    result["build_s"] = built.build_s;
    result["cpu_s"] = built.cpu_s;
    result["peak_mb"] = built.peak_mb;
    result["basis"] = built.basis;
    result["cubature_tets"] = built.cubature_tets;
    result["error_mean"] = built.error_mean;
    result["error_max"] = built.error_max;
    result["met_tolerance"] = built.met_tolerance == 1;
    result["modes_s"] = built.modes_s;
    result["poses_s"] = built.poses_s;
    result["basis_s"] = built.basis_s;
    result["cubature_s"] = built.cubature_s;
    result["first_picture_ms"] = built.first_picture_ms;
    result["first_final_ms"] = built.first_final_ms;
    recorder.add(result);
  }
}

}  // namespace limber::bench
