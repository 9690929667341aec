// How many modes a scene needs: of sessions that choose r themselves, the optimal energies that
// they compare, what they choose to a tolerance, and what that takes. The scenes are those of the
// suite "exact", and the task kConstraints on public bodies. $LIMBER_BENCH_ONLY: only scenes whose
// names contain it.
//
// energy_30: of the final result with the default modes. energy_chosen: of the session's last final
// result, with `modes` of them. tried: the most that were compared, saving: the share of the energy
// that those save. first_final_ms: until the first final result, build_ms: of its model; choice_ms:
// from there (its check included) until there is nothing left to find out; rebuild_ms: of that the
// build of a model with the chosen modes. edit_30_ms, edit_ms: from an edit that moves a target by
// a hundredth of the body to its final result, with the default modes and with the chosen ones.
#include <fmt/core.h>

#include <atomic>

#include "bench/exact_scenes.h"
#include "bench/suite.h"
#include "engine/session/bodies/session.h"
#include "tests/support/material_bodies.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kQuickTets = 12'000;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// When the first final result came, and how it was.
struct Watch final : session::BodyListener {
  Clock::time_point begin = Clock::now();
  double first_final_ms = 0, energy = 0;
  void on_state(session::State, const std::string&) override {}
  void on_result(const std::shared_ptr<const session::BodyResult>& one) override {
    if (!one->is_final || first_final_ms > 0) return;
    first_final_ms = ms_since(begin);
    energy = one->report.total_energy;
  }
};

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
    result["edit_30_ms"] = edited_ms(scene, {});
    session::SessionOptions choosing;
    choosing.mode_choice = session::ModeChoiceOptions();
    const auto watch = std::make_shared<Watch>();
    session::BodySession session("modes", scene, choosing, nullptr, inline_executor(), watch);
    const double all_ms = ms_since(watch->begin);
    const auto last = session.final_result();
    const session::ModeChoice choice = session.mode_choice();
    result["state"] = static_cast<int>(choice.state);
    result["modes"] = choice.modes;
    result["tried"] = choice.energies.empty() ? choice.modes : choice.energies.back().modes;
    result["saving"] = choice.saving.value_or(0);
    result["fewer"] = choice.fewer;
    result["energy_30"] = watch->energy;
    result["energy_chosen"] = last->report.total_energy;
    result["first_final_ms"] = watch->first_final_ms;
    result["choice_ms"] = all_ms - watch->first_final_ms;
    result["rebuild_ms"] = choice.modes > 30 ? 1e3 * session.build_seconds() : 0;
    result["basis"] = session.model()->basis_size();
    result["cubature"] = session.model()->cubature_size();
    scene::Scene named = scene;
    named.model.mode_count = choice.modes;
    result["edit_ms"] = edited_ms(named, {});
    std::string energies;
    for (const auto& one : choice.energies)
      energies += fmt::format(" {}:{:.5g}", one.modes, one.energy);
    recorder_.note(fmt::format("  {} modes,{}; first {:.3g} ms, choice {:.3g} ms ({})",
                               choice.modes, energies, watch->first_final_ms,
                               all_ms - watch->first_final_ms, choice.reason));
    recorder_.add(result);
  }

  void run_public(const testing::BodyFile& file) {
    const auto folder = std::filesystem::path(options_.shared_folder) / "data" / "bodies";
    const std::optional<scene::Scene> body = testing::read_body(file, folder);
    if (!body) return recorder_.note("modes: " + file.name + " left out, no public data");
    if (options_.quick && body->mesh.tets.cols() > kQuickTets)
      return recorder_.note("modes: " + file.name + " left out by --quick");
    run(file.name, testing::with_task(*body, testing::BodyTask::kConstraints, cache_));
  }

 private:
  static session::Executor inline_executor() {
    return [](const std::function<void()>& task) { task(); };
  }

  /// Of a session that does not choose.
  double edited_ms(const scene::Scene& scene, const session::SessionOptions& options) {
    session::BodySession session("edited", scene, options, cache_, inline_executor(), nullptr);
    const double length =
        (scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff()).maxCoeff();
    const auto constraint = session.constraints().back();
    std::vector<double> times;
    for (int i = 0; i < options_.repeats; ++i) {
      const double away = 0.01 * length * (1 + i);
      session.edit({session::MoveConstraint{constraint.id,
                                            constraint.target + Eigen::Vector3d(0, 0, away)}});
      times.push_back(session.final_result()->since_edit_ms);
    }
    return median(times);
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
