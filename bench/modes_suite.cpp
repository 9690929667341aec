// Number of modes that a scene needs. For sessions that choose r themselves: the optimal energies
// that they compare, their choice to a tolerance, and its cost. The scenes are those of the suite
// "exact", and the task kConstraints on public bodies. $LIMBER_BENCH_ONLY: only scenes whose names
// contain it.
//
// `energy_30`: of the final result with the default modes. `energy_chosen`: of the session's last
// final result, with `modes` of them. `tried`: the most that were compared, saving: the share of
// the energy that those save. `first_final_ms`: until the first final result, build_ms: of its
// model. `choice_ms`: from there (its check included) until there is nothing left to find out.
// `rebuild_ms`: the part of that for the build of a model with the chosen modes.
//
// Then the same edits, which move a target by a hundredth of the body each, in three sessions. They
// are one with the default modes (_30), this one, and one that may shrink to kFewest modes
// (_fewest; fewest: the number it took). `first_ms` and `final_ms`: from an edit to its first and
// its final result, medians. `shape_fewest`, `energy_fewest`: final results with the fewest against
// those with the default modes, the worst frame as a share of the motion's largest one, and the
// share of the energy.
#include <fmt/core.h>

#include <atomic>

#include "bench/exact_scenes.h"
#include "bench/public_body.h"
#include "bench/suite.h"
#include "engine/session/bodies/session.h"
#include "tests/support/material_bodies.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostTetsOfQuickModes = 12'000, kFewest = 8;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// When the first result and the first final one came, and how that was.
struct Watch final : session::BodyListener {
  Clock::time_point begin = Clock::now();
  double first_ms = 0, first_final_ms = 0, energy = 0;
  void on_state(session::State, const std::string&) override {}
  void on_result(const std::shared_ptr<const session::BodyResult>& one) override {
    if (first_ms == 0) first_ms = ms_since(begin);
    if (!one->is_final || first_final_ms > 0) return;
    first_final_ms = ms_since(begin);
    energy = one->report.total_energy;
  }
  void start() {
    begin = Clock::now();
    first_ms = first_final_ms = 0;
  }
};

/// A session under edits.
struct Edited {
  std::shared_ptr<Watch> watch = std::make_shared<Watch>();
  std::unique_ptr<session::BodySession> session;
  std::vector<double> first, final;  // [ms]
  void edit(const session::BodyEdit& edit) {
    watch->start();
    session->edit({edit});
    first.push_back(watch->first_ms);
    final.push_back(watch->first_final_ms);
  }
};

/// The worst frame as a share of the motion's largest one. @param rest  3n
double shape_difference(const Eigen::MatrixXd& motion, const Eigen::MatrixXd& other,
                        const Eigen::VectorXd& rest) {
  return (other - motion).colwise().norm().maxCoeff() /
         (motion.colwise() - rest).colwise().norm().maxCoeff();
}

class ModesSuite {
 public:
  ModesSuite(const SuiteOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder) {}

  void run(const std::string& name, const scene::Scene& scene) {
    recorder_.note("modes: " + name);
    Case result;
    result["scene"] = name;
    result["tets"] = scene.mesh.tet_count();
    result["tolerance"] = scene.model.tolerance;
    session::SessionOptions choosing;
    choosing.mode_choice = session::ModeChoiceOptions();
    Edited chosen;
    chosen.session = std::make_unique<session::BodySession>("modes", scene, choosing, nullptr,
                                                            inline_executor(), chosen.watch);
    const session::BodySession& session = *chosen.session;
    const double all_ms = ms_since(chosen.watch->begin), first_ms = chosen.watch->first_final_ms;
    const auto last = session.final_result();
    const session::ModeChoice choice = session.mode_choice();
    result["state"] = static_cast<int>(choice.state);
    result["modes"] = choice.modes;
    result["tried"] = choice.energies.empty() ? choice.modes : choice.energies.back().modes;
    result["saving"] = choice.saving.value_or(0);
    result["fewer"] = choice.fewer;
    result["energy_30"] = chosen.watch->energy;
    result["energy_chosen"] = last->report.total_energy;
    result["first_final_ms"] = first_ms;
    result["choice_ms"] = all_ms - first_ms;
    result["rebuild_ms"] = choice.modes > 30 ? 1e3 * session.build_seconds() : 0;
    result["basis"] = session.model()->basis_size();
    result["cubature"] = session.model()->cubature_size();
    compare_edits(scene, chosen, result);
    std::string energies;
    for (const auto& one : choice.energies)
      energies += fmt::format(" {}:{:.5g}", one.modes, one.energy);
    recorder_.note(fmt::format("  {} modes,{}; first {:.3g} ms, choice {:.3g} ms ({})",
                               choice.modes, energies, first_ms, all_ms - first_ms, choice.reason));
    recorder_.add(result);
  }

  void run_public(const testing::BodyFile& file) {
    if (const auto body = public_body(file, "modes", kMostTetsOfQuickModes, options_, recorder_))
      run(file.name, testing::with_task(*body, testing::BodyTask::kConstraints, cache_));
  }

 private:
  static session::Executor inline_executor() {
    return [](const std::function<void()>& task) { task(); };
  }

  Edited opened(const scene::Scene& scene, const session::SessionOptions& options) {
    Edited edited;
    edited.session = std::make_unique<session::BodySession>("edited", scene, options, cache_,
                                                            inline_executor(), edited.watch);
    return edited;
  }

  void compare_edits(const scene::Scene& scene, Edited& chosen, Case& result) {
    session::SessionOptions shrinking;
    shrinking.mode_choice = session::ModeChoiceOptions();
    shrinking.mode_choice->least = kFewest;
    Edited usual = opened(scene, {}), fewest = opened(scene, shrinking);
    const double length =
        (scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff()).maxCoeff();
    const Eigen::VectorXd rest =
        Eigen::Map<const Eigen::VectorXd>(scene.mesh.nodes.data(), scene.mesh.nodes.size());
    const auto constraint = usual.session->constraints().back();
    double shape = 0, energy = 0;
    for (int i = 0; i < 2 * options_.repeats + 1; ++i) {
      const Eigen::Vector3d away(0, 0, 0.01 * length * (1 + i % 7));
      for (Edited* one : {&usual, &chosen, &fewest}) {
        one->edit(session::MoveConstraint{constraint.id, constraint.target + away});
        if (i > 0) continue;  // the first one changes modes
        one->first.clear();
        one->final.clear();
      }
      const auto of_usual = usual.session->final_result(), of_few = fewest.session->final_result();
      const auto frames_of = [&](const Edited& one, const session::BodyResult& motion) {
        return one.session->positions(motion, 0, scene.frame_count);
      };
      shape = std::max(
          shape, shape_difference(frames_of(usual, *of_usual), frames_of(fewest, *of_few), rest));
      energy = std::max(energy, of_few->report.total_energy / of_usual->report.total_energy - 1);
    }
    result["fewest"] = fewest.session->mode_choice().modes;
    result["first_30_ms"] = median(usual.first);
    result["first_ms"] = median(chosen.first);
    result["first_fewest_ms"] = median(fewest.first);
    result["final_30_ms"] = median(usual.final);
    result["final_ms"] = median(chosen.final);
    result["final_fewest_ms"] = median(fewest.final);
    result["shape_fewest"] = shape;
    result["energy_fewest"] = energy;
  }

  const SuiteOptions& options_;
  Recorder& recorder_;
  TemporaryFolder folder_;
  std::shared_ptr<session::ModelCache> cache_ =
      std::make_shared<session::ModelCache>(folder_.path());
};

}  // namespace

void modes_suite(const SuiteOptions& options, Recorder& recorder) {
  run_exact_scenes(ModesSuite(options, recorder));
}

}  // namespace limber::bench
