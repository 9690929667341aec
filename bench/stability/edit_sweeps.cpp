// Sessions under many edits, one solved before the next. Compared are the last answer and a session
// that opens the edited scene and solves it from rest. Further: memory, and the time of edits in
// the first and the last tenth of the session.

#include <fmt/core.h>

#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "bench/stability/box_bodies.h"
#include "bench/stability/sweep.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/session/beams/session.h"
#include "engine/session/bodies/session.h"
#include "engine/session/linkages/session.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/session/beams/scenes.h"

namespace limber::bench::stability {
namespace {

constexpr double kAllowedAnswer = 1e-6;
constexpr double kAllowedGrowth = 64;  // MB, after the first tenth of the edits
constexpr double kDefaultEdits = 1e5;
constexpr double kSecondsOfEdit = 3e-3;  // wall limit, of a machine with much else to do

session::Executor at_once() {
  return [](const std::function<void()>& task) { task(); };
}

/// Memory of this process [MB].
double resident() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, kept = 0;
  file >> pages >> kept;
  return kept * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Memory and times of edits along the way.
class Growth {
 public:
  explicit Growth(int edits)
      : tenth_(std::max(1, edits / 10)),
        first_last_(edits - tenth_),
        first_(tenth_),
        last_(tenth_) {}
  /// @param taken  wall time of the edit and its solve [ms]
  void after(int edit, float taken) {
    if (edit < tenth_) first_[static_cast<std::size_t>(edit)] = taken;
    if (edit >= first_last_) last_[static_cast<std::size_t>(edit - first_last_)] = taken;
    if (edit == tenth_) before_ = resident();
    if (edit + 1 == kEarlyEdits) early_ = resident();
  }
  /// Since a tenth of the edits was made [MB].
  [[nodiscard]] double now() const { return resident() - before_; }
  [[nodiscard]] std::string in_words() const {
    std::string words = fmt::format("An edit takes {} in the first tenth, {} in the last.",
                                    times_in_words(first_), times_in_words(last_));
    if (early_ > 0)
      words += fmt::format(" {:.1f} MB resident after {} edits, {:.1f} MB at the end.", early_,
                           kEarlyEdits, resident());
    return words;
  }

 private:
  static constexpr int kEarlyEdits = 10'000;
  static std::string times_in_words(std::vector<float> times) {
    const auto at = [&](double share) {
      const auto place = times.begin() +
                         static_cast<std::ptrdiff_t>(share * static_cast<double>(times.size() - 1));
      std::nth_element(times.begin(), place, times.end());
      return *place;
    };
    const float median = at(0.5);
    return fmt::format("{:.3f} ms (median) and {:.3f} ms (p99)", median, at(0.99));
  }

  int tenth_, first_last_;
  double before_ = 0, early_ = 0;
  std::vector<float> first_, last_;  // there from the beginning: no growth
};

/// Counts of all answers along the path.
struct Answers {
  int failed = 0, refused = 0;
  bool are_finite = true;
};

Finding finding_of(const Answers& answers, bool has_converged, double difference,
                   const Growth& growth, int edits, const std::string& message) {
  Finding finding;
  finding.claim = has_converged ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = answers.are_finite && std::isfinite(difference);
  finding.error = std::max(difference, growth.now() / kAllowedGrowth * kAllowedAnswer);
  finding.allowed = kAllowedAnswer;
  finding.message = fmt::format(
      "{} edits, {} refused, {} answers not converged, {:.1f} MB more; the last answer is off by "
      "{:.1e}. {} {}",
      edits, answers.refused, answers.failed, growth.now(), difference, growth.in_words(), message);
  return finding;
}

/// Makes the edits, each solved before the next.
/// @param any_edit  gives the next one, as a list of it; @param check  notes in `answers` the
/// faults of a result
template <class Session, class AnyEdit, class CheckResult>
Answers solve_edits(Session& session, int edits, Growth& growth, const AnyEdit& any_edit,
                    const CheckResult& check) {
  Answers answers;
  using Clock = std::chrono::steady_clock;
  for (int i = 0; i < edits; ++i) {
    const auto edit = any_edit();
    const Clock::time_point begin = Clock::now();
    try {
      session.edit(edit);
    } catch (const Error&) {  // nothing to undo, no such constraint
      ++answers.refused;
    }
    const std::chrono::duration<float, std::milli> taken = Clock::now() - begin;
    check(*session.final_result(), answers);
    growth.after(i, taken.count());
  }
  return answers;
}

/// For linkages and for beams.
constexpr auto check_shape = [](const auto& result, Answers& answers) {
  if (!result.report.converged()) ++answers.failed;
  answers.are_finite = answers.are_finite && result.frames->allFinite();
};

/// Moves of two targets of a body mostly, now and then others that come, go, and are undone.
Finding body_edits(double count) {
  using namespace session;
  const int edits = static_cast<int>(count);
  scene::Scene scene =
      scene_of(box_body({3, 1, 2}, {0.3, 0.1, 0.2}, Held::kLeftFace, {1e6, 0.4, 1000}), 0.2);
  scene.frame_count = 16;
  scene.constraints[0].frame = 5;
  scene.constraints[1].frame = 10;
  scene.model.mode_count = 4;
  scene.model.basis_size = 8;
  scene.model.cubature_size = 4;
  const auto models = std::make_shared<ModelCache>("");
  SessionOptions options;
  options.max_constraints = 8;
  BodySession session("edited", scene, options, models, at_once(), nullptr);
  Random random(2027);
  Growth growth(edits);
  const auto target = [&] {
    return Eigen::Vector3d(0, random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05));
  };
  const auto any_edit = [&]() -> std::vector<BodyEdit> {
    switch (random.index(16)) {
      case 0: {
        scene::Constraint added = scene.constraints[0];
        added.id = 0;
        added.frame = 3 + static_cast<int>(random.index(10));
        added.target = target();
        return {AddConstraint{added}};
      }
      case 1: {
        const auto there = session.constraints();
        return {RemoveConstraint{there.size() > 2 ? there.back().id : 0}};
      }
      case 2:
        return {Undo{}};
      case 3:
        return {Redo{}};
      default:
        return {MoveConstraint{1 + random.index(2), target()}};
    }
  };
  const auto check = [](const BodyResult& result, Answers& answers) {
    if (result.report.status != spacetime::SolveStatus::kConverged) ++answers.failed;
    answers.are_finite = answers.are_finite && result.modal.allFinite();
  };
  const Answers answers = solve_edits(session, edits, growth, any_edit, check);
  const auto last = session.final_result();
  const BodySession fresh("fresh", session.scene(), options, models, at_once(), nullptr);
  const auto expected = fresh.final_result();
  const double rest = 100 * 0.5 * 0.05 * 0.05;  // the size of energies here
  const double difference =
      std::max(std::abs(last->report.total_energy - expected->report.total_energy) /
                   std::max(expected->report.total_energy, 1e-6 * rest),
               last->revision == session.revision() ? 0.0 : 1.0);
  return finding_of(answers, last->report.status == spacetime::SolveStatus::kConverged, difference,
                    growth, edits, last->report.message);
}

/// Loads of a cantilever of four elements.
Finding beam_edits(double count) {
  using namespace session;
  const int edits = static_cast<int>(count);
  BeamSession session("edited", test::cantilever(4, 0.5), {}, at_once(), nullptr);
  Random random(2028);
  Growth growth(edits);
  const auto any_edit = [&]() -> std::vector<BeamEdit> {
    const auto choice = random.index(12);
    const int node = 1 + static_cast<int>(random.index(4));
    if (choice == 0) return {Undo{}};
    if (choice == 1) return {Redo{}};
    return {SetNodeLoad{test::force_on(node, random.uniform(-0.2, 0.2), random.uniform(-0.5, 0.5),
                                       random.uniform(-0.5, 0.5))}};
  };
  const Answers answers = solve_edits(session, edits, growth, any_edit, check_shape);
  const auto last = session.final_result();
  const BeamSession fresh("fresh", session.model(), {}, at_once(), nullptr);
  const auto expected = fresh.final_result();
  const auto& here = last->analysis->solution.state.positions;
  const auto& there = expected->analysis->solution.state.positions;
  return finding_of(answers, last->report.converged(), (here - there).norm(), growth, edits,
                    last->report.message);
}

/// A target that pulls at a grid of four joints.
Finding linkage_edits(double count) {
  using namespace session;
  const int edits = static_cast<int>(count);
  scene::Linkage linkage;
  linkage.lines = rods::testing::sheared_grid(2, 2, 1.0, 0.5);
  linkage.edges_per_segment = 4;
  linkage.conditions.pins = {{0, scene::Held::kMotionAndAngle, {}}};
  const Eigen::Vector3d drawn = linkage.lines.vertices.col(3);
  scene::LinkageTarget target;
  target.joint = 3;
  target.position = drawn;
  target.stiffness = 100;
  linkage.conditions.targets = {target};
  LinkageSession session("edited", linkage, {}, at_once(), nullptr);
  Random random(2029);
  Growth growth(edits);
  const auto any_edit = [&]() -> std::vector<LinkageEdit> {
    const auto choice = random.index(12);
    if (choice == 0) return {Undo{}};
    if (choice == 1) return {Redo{}};
    return {MoveTarget{
        1, drawn + Eigen::Vector3d(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05),
                                   random.uniform(-0.05, 0.05))}};
  };
  const Answers answers = solve_edits(session, edits, growth, any_edit, check_shape);
  const auto last = session.final_result();
  const LinkageSession fresh("fresh", session.linkage(), {}, at_once(), nullptr);
  const auto expected = fresh.final_result();
  double difference = 0;
  for (std::size_t j = 0; j < last->state->joints().size(); ++j)
    difference = std::max(
        difference,
        (last->state->joints()[j].position - expected->state->joints()[j].position).norm());
  return finding_of(answers, last->report.converged(), difference, growth, edits,
                    last->report.message);
}

/// Decades up to so many edits.
std::vector<double> lengths(double longest) {
  std::vector<double> values;
  for (double edits = 1e3; edits < longest; edits *= 100) values.push_back(edits);
  values.push_back(longest);
  return values;
}

Sweep edit_sweep(const char* name, double longest, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "sessions";
  sweep.name = name;
  sweep.parameter = "edits";
  sweep.asked = "random edits, undone and redone, each solved before the next";
  sweep.check = "a session opened with the last scene; memory by 64 MB at most";
  sweep.values = lengths(longest);
  sweep.required = static_cast<int>(sweep.values.size());
  sweep.run = std::move(run);
  sweep.seconds = 60 + kSecondsOfEdit * longest;
  return sweep;
}

}  // namespace

Sweeps edit_sweeps() {
  const char* const given = std::getenv("LIMBER_STABILITY_EDITS");
  const double most = std::max(1e3, given != nullptr ? std::atof(given) : kDefaultEdits);
  return {edit_sweep("edits of a body", most, body_edits),
          edit_sweep("edits of beams", most / 10, beam_edits),
          edit_sweep("edits of a linkage", most, linkage_edits)};
}

}  // namespace limber::bench::stability
