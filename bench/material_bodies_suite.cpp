// Effect of fitted materials on motions, on all samples and on the bodies of the public data.
// Figures, each next to that of the motion of forces alone: share of high frequencies, largest step
// between frames [body lengths] and energy. Also published results above the energy that the fit
// started from.
//
// Samples: "sample" is the scene as it comes, "sample, free ends" the same with both ends free. All
// bodies: the tasks of tests/support/material_bodies.h with default models. --quick: bodies of up
// to 10,000 tets, two tasks. $LIMBER_BENCH_ONLY: only bodies whose names contain it.
#include <fmt/core.h>

#include <ctime>

#include "bench/public_body.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/scene/samples/samples.h"
#include "tests/support/material_bodies.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

using testing::BodyTask;

constexpr Eigen::Index kMostTetsOfQuickBodies = 10'000;

class BodySuite {
 public:
  BodySuite(const SuiteOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder) {}

  void run_tasks(const scene::Scene& body) {
    if (options_.quick && body.mesh.tets.cols() > kMostTetsOfQuickBodies)
      return recorder_.note("material_bodies: " + body.name + " left out by --quick");
    for (const BodyTask task :
         {BodyTask::kConstraints, BodyTask::kLastEndFree, BodyTask::kBothEndsFree,
          BodyTask::kKeyframes, BodyTask::kFreeBody}) {
      const bool is_quick = task == BodyTask::kConstraints || task == BodyTask::kBothEndsFree;
      if (options_.quick && !is_quick) continue;
      run(body.name, name_of(task), [&] { return with_task(body, task, cache_); });
    }
  }

  void run(const std::string& body, const std::string& task,
           const std::function<scene::Scene()>& make) {
    recorder_.note(fmt::format("material_bodies: {}, {}", body, task));
    testing::FittedMotion motion;
    const auto begin = std::clock();
    try {
      motion = testing::fit_motion(make(), cache_);
    } catch (const Error& error) {
      return recorder_.note(fmt::format("material_bodies: {}, {}: {}", body, task, error.what()));
    }
    Case result;
    result["body"] = body;
    result["task"] = task;
    result["tets"] = motion.tets;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // null in the file
    result["high_frequency_share_forces"] = motion.high_frequency_share_forces.value_or(kNone);
    result["high_frequency_share"] = motion.high_frequency_share.value_or(kNone);
    result["largest_step_forces"] = motion.largest_step_forces;
    result["largest_step"] = motion.largest_step;
    result["largest_step_ratio"] = motion.largest_step_ratio();
    result["largest_step_frame"] = motion.largest_step_frame;
    result["energy_forces"] = motion.energy_forces;
    result["energy"] = motion.energy;
    result["published"] = motion.published;
    result["published_above_start"] = motion.published_above_start;
    result["shape_error"] = motion.shape_error;
    result["inverted_tets"] = motion.inverted_tets;
    result["status"] = motion.status;
    result["cpu_s"] = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    recorder_.note(
        fmt::format("  share {:.2g}, largest step ratio {:.3g}, {} of {} above start, {:.3g} s",
                    motion.high_frequency_share.value_or(kNone), motion.largest_step_ratio(),
                    motion.published_above_start, motion.published, result["cpu_s"].get<double>()));
    recorder_.add(result);
  }

 private:
  const SuiteOptions& options_;
  Recorder& recorder_;
  TemporaryFolder folder_;
  std::shared_ptr<session::ModelCache> cache_ =
      std::make_shared<session::ModelCache>(folder_.path());
};

}  // namespace

void material_bodies_suite(const SuiteOptions& options, Recorder& recorder) {
  BodySuite suite(options, recorder);
  for (const std::string& name : scene::sample_names()) {
    if (!is_selected(name)) continue;
    const scene::Scene sample = scene::make_sample(name);
    suite.run(name, "sample", [&] { return sample; });
    scene::Scene with_free_ends = sample;
    with_free_ends.first_end = with_free_ends.last_end = scene::End::kFree;
    suite.run(name, "sample, free ends", [&] { return with_free_ends; });
    suite.run_tasks(sample);
  }
  for (const testing::BodyFile& file : testing::public_bodies()) {
    if (!is_selected(file.name)) continue;
    if (const auto body =
            public_body(file, "material_bodies", kMostTetsOfQuickBodies, options, recorder))
      suite.run_tasks(*body);
  }
}

}  // namespace limber::bench
