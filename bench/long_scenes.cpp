// The sample flower with its 20 constraints, stretched over N frames: constraints keep their share
// of the motion, the lowest mode its number of frames to a swing.
#include "bench/long_scenes.h"

#include <malloc.h>

#include <memory>

#include "bench/cpu_time.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/session.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

scene::Scene stretched_flower(int frames) {
  scene::Scene scene = scene::make_sample("flower");
  const std::int64_t own = scene.frame_count;
  for (scene::Constraint& constraint : scene.constraints)
    constraint.frame = static_cast<int>(constraint.frame * std::int64_t{frames} / own);
  scene.frame_count = frames;
  return scene;
}

/// That the program has allocated now.
double allocated_bytes() {
  const struct mallinfo2 heap = mallinfo2();
  return static_cast<double>(heap.uordblks + heap.hblkhd);
}

class ResultTimes final : public session::BodyListener {
 public:
  void on_state(session::State /*state*/, const std::string& /*message*/) override {}
  void on_result(const std::shared_ptr<const session::BodyResult>& result) override {
    if (first_ms_ < 0) first_ms_ = result->since_edit_ms;
    if (!result->is_final || !result->is_exact) reduced_ms_ = result->since_edit_ms;
  }
  bool wants_early_frames() override { return true; }
  void on_early_frames(
      const std::vector<std::shared_ptr<const session::BodyResult>>& parts) override {
    if (early_ms_ < 0) early_ms_ = parts.back()->since_edit_ms;
  }
  void reset() { early_ms_ = first_ms_ = -1; }
  /// Below 0: none came.
  [[nodiscard]] double early_ms() const { return early_ms_; }
  [[nodiscard]] double first_ms() const { return first_ms_; }
  [[nodiscard]] double reduced_ms() const { return reduced_ms_; }

 private:
  double early_ms_ = -1, first_ms_ = -1, reduced_ms_ = 0;
};

struct Edits {
  std::vector<double> early, first, reduced, final, cpu;
  double bytes = 0;
  bool is_exact = false;
};

Edits run_edits(int frames, session::Exactness exactness, int repeats,
                const std::shared_ptr<session::ModelCache>& cache) {
  const auto listener = std::make_shared<ResultTimes>();
  session::SessionOptions options;
  options.exactness = exactness;
  const double before = allocated_bytes();
  session::BodySession session(
      "long", stretched_flower(frames), options, cache,
      [](const std::function<void()>& task) { task(); }, listener);
  const scene::Constraint moved = session.constraints()[session.constraints().size() / 2];
  Edits edits;
  for (int i = 0; i < repeats; ++i) {
    const Eigen::Vector3d away(0, 0.002 * (i % 2) + 0.0001 * i, 0.004);
    listener->reset();
    const double begin = user_seconds();
    session.edit({session::MoveConstraint{moved.id, moved.target + away}});
    edits.cpu.push_back(1e3 * (user_seconds() - begin));
    if (listener->early_ms() >= 0) edits.early.push_back(listener->early_ms());
    edits.first.push_back(listener->first_ms());
    edits.reduced.push_back(listener->reduced_ms());
    edits.final.push_back(session.final_result()->since_edit_ms);
  }
  edits.bytes = allocated_bytes() - before;
  edits.is_exact = session.final_result()->is_exact;
  return edits;
}

}  // namespace

void run_long_scenes(const SuiteOptions& options, Recorder& recorder) {
  const TemporaryFolder folder;
  const auto cache = std::make_shared<session::ModelCache>(folder.path());
  const int repeats = options.quick ? 3 : 9;
  for (const auto exactness : {session::Exactness::kReduced, session::Exactness::kFull}) {
    double bytes_of_shortest = 0;
    constexpr int kShortest = 1'000;
    for (const int frames : {kShortest, 10'000, 100'000}) {
      const std::string exact = exactness == session::Exactness::kFull ? "full" : "reduced";
      recorder.note("spacetime: flower, " + std::to_string(frames) + " frames, " + exact);
      const Edits edits = run_edits(frames, exactness, repeats, cache);
      Case result;
      result["scene"] = "flower, stretched";
      result["exactness"] = exact;
      result["frames"] = frames;
      if (!edits.early.empty()) result["early_ms"] = median(edits.early);
      result["first_ms"] = median(edits.first);
      result["reduced_ms"] = median(edits.reduced);
      result["final_ms"] = median(edits.final);
      result["user_ms"] = median(edits.cpu);
      if (frames == kShortest) {
        bytes_of_shortest = edits.bytes;
      } else {
        result["bytes_a_frame"] = (edits.bytes - bytes_of_shortest) / (frames - kShortest);
      }
      result["is_exact"] = edits.is_exact;
      result["edits"] = repeats;
      recorder.add(result);
    }
  }
}

}  // namespace limber::bench
