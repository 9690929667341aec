// The exact step against the judge: three soft constraints of 0.1 to 0.3 body lengths (task
// kConstraints of tests/support/material_bodies.h). The bodies are untuned ones and a beam that is
// bent by 270 and twisted by 135 degrees; models of default options. $LIMBER_BENCH_ONLY: only
// bodies whose names contain it.
//
// `energy_reduced`: of the optimum of the reduced model, by the reduced model. `energy_shown`: of
// the same motion by the full map. `energy_exact`: after the exact step from there. `energy_judge`:
// of the plainly written full-space solver from the same start. `shape_error_before`: of the
// reduced model's frames of the exact motion. A session with the same scene then moves its last
// target by a twentieth of the body's length. `first_ms`, `final_ms`: from that edit to its first
// and its exact result. `shape_error_after`: of the latter's frames, and the columns of their
// basis.
#include <fmt/core.h>

#include "bench/exact_scenes.h"
#include "bench/judge/full_space_judge.h"
#include "bench/public_body.h"
#include "bench/suite.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/motion_error.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/session.h"
#include "tests/support/material_bodies.h"
#include "tests/support/published.h"
#include "tests/support/temporary_folder.h"

namespace limber::bench {
namespace {

using Eigen::Index;

constexpr int kJudgeSteps = 400, kQuickJudgeSteps = 60;
constexpr int kQuickTets = 12'000;

class ExactSuite {
 public:
  ExactSuite(const SuiteOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder) {}

  void run(const std::string& name, const scene::Scene& scene) {
    recorder_.note("exact: " + name);
    const session::MappedBody mapped = session::map_body(scene);
    const auto model = std::make_shared<const reduced::ReducedModel>(
        reduced::build_model(mapped.body, session::map_model(scene, mapped.body)));
    const spacetime::ModeDynamics dynamics =
        session::map_dynamics(testing::published_dynamics(scene.dynamics.period_frames),
                              model->eigenvalues, model->rigid_count, model->mechanism_count);
    spacetime::Timeline timeline;
    timeline.frame_count = scene.frame_count;
    const auto reduced_kinematics = std::make_shared<reduced::ReducedKinematics>(model);
    const auto full_kinematics = std::make_shared<reduced::FullKinematics>(
        mapped.body, model, std::make_shared<const reduced::FullReconstruction>(mapped.body));
    const session::TargetFrame frame(scene, mapped);
    JudgedProblem judged{mapped.body, model->modes, model->length, dynamics, scene.frame_count, {}};
    spacetime::Solver reduced_solver(reduced_kinematics, dynamics, timeline);
    spacetime::Solver exact_solver(full_kinematics, dynamics, timeline);
    for (const scene::Constraint& item : scene.constraints) {
      const reduced::Site site = frame.site(item);
      spacetime::PositionConstraint constraint;
      constraint.id = judged.targets.size() + 1;
      constraint.frame = item.frame;
      constraint.target = frame.displacement(item.target, frame.origin(item.kind, site));
      constraint.weight = item.weight;
      constraint.site = reduced_kinematics->add_site(site);
      full_kinematics->add_site(site);
      reduced_solver.add(constraint);
      exact_solver.add(constraint);
      judged.targets.push_back({site.nodes.front(), item.frame, constraint.target, item.weight});
    }
    Case result;
    result["scene"] = name;
    result["tets"] = mapped.body.mesh.tet_count();
    result["constraints"] = judged.targets.size();
    spacetime::SolveReport reduced_report, exact_report;
    result["reduced_ms"] = milliseconds([&] { reduced_report = reduced_solver.solve(); });
    const Eigen::MatrixXd start = reduced_solver.motion();
    result["energy_reduced"] = reduced_report.total_energy;
    result["energy_shown"] = judge(judged, start, 0).energy;
    std::vector<double> times;
    for (int i = 0; i < options_.repeats; ++i) {
      exact_solver.warm_start(start, spacetime::Known::kAnswer);
      times.push_back(milliseconds([&] { exact_report = exact_solver.solve(); }));
    }
    result["energy_exact"] = exact_report.total_energy;
    result["polish_ms"] = median(times);
    result["polish_steps"] = exact_report.iterations;
    result["status"] = static_cast<int>(exact_report.status);
    Judgement verdict;
    result["judge_ms"] = milliseconds(
        [&] { verdict = judge(judged, start, options_.quick ? kQuickJudgeSteps : kJudgeSteps); });
    result["energy_judge"] = verdict.energy;
    result["judge_steps"] = verdict.steps;
    result["judge_settled"] = verdict.settled;
    result["energy_error_reduced"] = reduced_report.total_energy / verdict.energy - 1;
    result["energy_error_exact"] = exact_report.total_energy / verdict.energy - 1;
    result["miss_difference"] =
        std::abs(exact_report.max_constraint_error - verdict.max_miss) / model->length;
    result["shape_error_before"] =
        shape_error(mapped.body, model, *reduced_kinematics, exact_solver.motion());
    add_edit(scene, mapped.body, model->length / scene.length_unit_in_metres, result);
    recorder_.note(fmt::format("  energies {:.6g} {:.6g} {:.6g}, {:.3g} ms",
                               reduced_report.total_energy, exact_report.total_energy,
                               verdict.energy, median(times)));
    recorder_.add(result);
  }

  void run_public(const testing::BodyFile& file) {
    if (const auto body = public_body(file, "exact", kQuickTets, options_, recorder_))
      run(file.name, testing::with_task(*body, testing::BodyTask::kConstraints, cache_));
  }

 private:
  static double shape_error(const bodies::ElasticBody& body,
                            const std::shared_ptr<const reduced::ReducedModel>& model,
                            const reduced::ReducedKinematics& kinematics,
                            const Eigen::MatrixXd& motion) {
    reduced::FullShapes shapes(body, model);
    reduced::ShownFrames shown;
    for (int i = 0; i < motion.cols(); i += kStride) shown.frames.push_back(i);
    shown.modal = motion(Eigen::all, shown.frames);
    Eigen::MatrixXf all;
    kinematics.coordinates(0, motion, all);
    shown.coordinates = all(Eigen::all, shown.frames);
    return reduced::motion_error(shapes, shown).shape_error;
  }

  /// @param length  of the body [scene unit]
  void add_edit(const scene::Scene& scene, const bodies::ElasticBody& body, double length,
                Case& result) {
    double first_ms = 0;
    struct Listener final : session::BodyListener {
      double* first_ms;
      explicit Listener(double* first) : first_ms(first) {}
      void on_state(session::State, const std::string&) override {}
      void on_result(const std::shared_ptr<const session::BodyResult>& one) override {
        if (*first_ms == 0) *first_ms = one->since_edit_ms;
      }
    };
    const auto listener = std::make_shared<Listener>(&first_ms);
    session::BodySession session(
        "exact", scene, {}, cache_, [](const std::function<void()>& task) { task(); }, listener);
    const auto constraint = session.constraints().back();
    std::vector<double> first, final;
    for (int i = 0; i < options_.repeats; ++i) {
      const double away = (i % 2 == 0 ? 1.0 : 0.0) + 0.01 * i;  // no answer that is known already
      first_ms = 0;
      session.edit({session::MoveConstraint{
          constraint.id, constraint.target + Eigen::Vector3d(0, 0, 0.05 * length * away)}});
      first.push_back(first_ms);
      final.push_back(session.final_result()->since_edit_ms);
    }
    const auto last = session.final_result();
    result["first_ms"] = median(first);
    result["final_ms"] = median(final);
    result["final_is_exact"] = last->is_exact;
    reduced::FullShapes shapes(body, session.model());
    reduced::ShownFrames shown;
    for (int i = 0; i < last->modal.cols(); i += kStride) shown.frames.push_back(i);
    shown.modal = last->modal(Eigen::all, shown.frames);
    shown.coordinates = last->coordinates(Eigen::all, shown.frames);
    shown.basis = last->shown->basis;
    result["shape_error_after"] = reduced::motion_error(shapes, shown).shape_error;
    result["shown_columns"] = shown.coordinates.rows();
  }

  static constexpr int kStride = 4;  // frames whose shapes are compared

  const SuiteOptions& options_;
  Recorder& recorder_;
  TemporaryFolder folder_;
  std::shared_ptr<session::ModelCache> cache_ =
      std::make_shared<session::ModelCache>(folder_.path());
};

}  // namespace

void exact_suite(const SuiteOptions& options, Recorder& recorder) {
  run_exact_scenes(ExactSuite(options, recorder));
}

}  // namespace limber::bench
