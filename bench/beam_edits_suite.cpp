// Random edits of beam structures in a live session, and a large grid under its own weight.

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "bench/cpu_time.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/session/beams/document.h"
#include "engine/session/beams/live_problem.h"
#include "tests/support/beam_grid.h"
#include "tests/support/beam_structures.h"

namespace limber::bench {
namespace {

using session::BeamConditions;
using session::LiveBeams;
using Conditions = std::shared_ptr<const BeamConditions>;

// An edit is not awaited longer; the case says "cancelled".
constexpr std::chrono::seconds kPatience{150};

/// Cancels a job that takes too long.
class Deadline {
 public:
  explicit Deadline(Cancellation cancellation)
      : thread_([this, cancellation]() mutable {
          std::unique_lock lock(mutex_);
          if (!ended_.wait_for(lock, kPatience, [this] { return is_over_; }))
            cancellation.request();
        }) {}
  ~Deadline() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    ended_.notify_all();
    thread_.join();
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_over_ = false;
  std::thread thread_;
};

struct SolvedEdit {
  LiveBeams::Outcome outcome;
  double wall_ms = 0, user_ms = 0;
};

SolvedEdit solve(LiveBeams& live, const Conditions& conditions) {
  SolvedEdit solved;
  JobContext job;
  const Deadline deadline(job.cancellation);
  const double before = user_seconds();
  solved.wall_ms = milliseconds(
      [&] { solved.outcome = live.solve(conditions, job, [](const beams::BeamState&) {}); });
  solved.user_ms = 1e3 * (user_seconds() - before);
  return solved;
}

void add_work(const SolvedEdit& solved, Case& result) {
  const beams::BeamReport& report = solved.outcome.report;
  result["ended"] = to_string(report.status);
  result["load_factor"] = report.load_factor;
  result["edit_ms"] = solved.wall_ms;
  result["user_ms"] = solved.user_ms;
  result["factorizations"] = report.factorizations;
  result["newton_iterations"] = report.newton_iterations;
  result["load_steps"] = report.load_steps;
  result["relaxation_steps"] = report.relaxation_steps;
  result["snaps"] = report.snaps.size();
  result["message"] = report.message;
}

/// Beside the table, so that cases are seen as they end.
void record(const Case& result, Recorder& recorder) {
  recorder.add(result);
  recorder.note(result.dump());
}

/// A case of its own: a structure that is opened.
Case opening_of(const std::string& structure, const SolvedEdit& solved) {
  Case result;
  result["structure"] = structure;
  result["edit"] = "open";
  add_work(solved, result);
  return result;
}

Conditions drawn_conditions(const beams::BeamModel& model) {
  return std::make_shared<const BeamConditions>(session::conditions_of(model));
}

/// Nodes where they are in the shape that is edited.
class ShownPlaces final : public session::BeamDocument::Places {
 public:
  explicit ShownPlaces(const beams::BeamModel& model, const beams::BeamState& state)
      : model_(model), state_(state) {}
  [[nodiscard]] beams::PrescribedMotion of(int node) const override {
    beams::PrescribedMotion motion;
    motion.node = node;
    motion.translates = {true, true, true};
    motion.translation =
        state_.positions.col(node) - model_.nodes[static_cast<std::size_t>(node)].position;
    return motion;
  }

 private:
  const beams::BeamModel& model_;
  const beams::BeamState& state_;
};

/// Choices from which random edits are drawn.
struct Drawing {
  const beams::BeamModel& model;
  const beams::BeamState& state;
  double extent = 0;
  std::vector<int> held{}, free{};

  Drawing(const beams::BeamModel& m, const beams::BeamState& s)
      : model(m), state(s), extent(testing::extent_of(m)) {
    std::vector<char> is_held(m.nodes.size(), 0);
    for (const auto& support : m.supports) is_held[static_cast<std::size_t>(support.node)] = 1;
    for (const auto& motion : m.motions) is_held[static_cast<std::size_t>(motion.node)] = 1;
    for (int i = 0; i < static_cast<int>(m.nodes.size()); ++i)
      (is_held[static_cast<std::size_t>(i)] != 0 ? held : free).push_back(i);
  }

  [[nodiscard]] session::BeamEdit move(const std::vector<int>& nodes, double share,
                                       Random& random) const {
    const int node = nodes[random.index(nodes.size())];
    beams::PrescribedMotion motion = ShownPlaces(model, state).of(node);
    motion.translation += share * extent * testing::random_direction(random);
    return session::MoveNode{motion};
  }
  /// A force by which the softest section, as long as the extent, would bend by about a share of
  /// it.
  [[nodiscard]] session::BeamEdit load(double share, Random& random) const {
    double bending = 0;
    for (const auto& section : model.sections) bending = std::max(bending, section.bending_2);
    beams::NodalLoad load;
    load.node = free[random.index(free.size())];
    load.force = 48 * share * bending / (extent * extent) * testing::random_direction(random);
    return session::SetNodeLoad{load};
  }
};

struct EditKind {
  const char* name;
  double least, most;  // shares of the extent
  session::BeamEdit (*draw)(const Drawing&, double share, Random& random);
};

constexpr EditKind kEditKinds[] = {
    {"move a held node", 0.01, 0.04,
     [](const Drawing& d, double share, Random& r) { return d.move(d.held, share, r); }},
    {"move a free node", 0.01, 0.04,
     [](const Drawing& d, double share, Random& r) { return d.move(d.free, share, r); }},
    {"load a node", 0.2, 2,
     [](const Drawing& d, double share, Random& r) { return d.load(share, r); }},
};
constexpr EditKind kSmallKinds[] = {
    {"move a held node by 0.5 %", 0.005, 0.005,
     [](const Drawing& d, double share, Random& r) { return d.move(d.held, share, r); }},
    {"move a free node by 0.5 %", 0.005, 0.005,
     [](const Drawing& d, double share, Random& r) { return d.move(d.free, share, r); }},
};

Case summary_of(const std::string& structure, const EditKind& kind,
                const std::vector<SolvedEdit>& all) {
  std::vector<double> wall, user, factorizations, factors;
  int reached = 0;
  for (const SolvedEdit& solved : all) {
    wall.push_back(solved.wall_ms);
    user.push_back(solved.user_ms);
    factorizations.push_back(solved.outcome.report.factorizations);
    factors.push_back(solved.outcome.report.load_factor);
    reached += solved.outcome.reached ? 1 : 0;
  }
  Case summary;
  summary["structure"] = structure;
  summary["edit"] = std::string(kind.name) + ", all";
  summary["number"] = all.size();
  summary["ended"] = std::to_string(reached) + " converged";
  summary["load_factor"] = median(factors);
  const auto add = [&summary](const std::string& name, const std::vector<double>& values) {
    summary[name] = median(values);
    summary[name + "_max"] = quantile(values, 1);
  };
  add("edit_ms", wall);
  add("user_ms", user);
  add("factorizations", factorizations);
  return summary;
}

/// Each edit begins from the structure as opened, so that edits do not depend on each other's ends.
void run_kind(const std::string& structure, const beams::BeamModel& model, const LiveBeams& opened,
              const EditKind& kind, int count, Recorder& recorder) {
  Random random(2026);
  const beams::BeamState shown = opened.state();
  const Drawing drawing(model, shown);
  std::vector<SolvedEdit> all;
  for (int i = 0; i < count; ++i) {
    session::BeamDocument document(model);
    const double share = random.uniform(kind.least, kind.most);
    try {
      document.apply({kind.draw(drawing, share, random)}, {}, ShownPlaces(model, shown));
    } catch (const Error& error) {
      recorder.note(structure + ", " + kind.name + ": refused: " + error.what());
      continue;
    }
    LiveBeams live(opened);
    all.push_back(solve(live, document.conditions()));
    Case result;
    result["structure"] = structure;
    result["edit"] = kind.name;
    result["number"] = i;
    result["share_of_extent"] = share;
    add_work(all.back(), result);
    record(result, recorder);
  }
  if (!all.empty()) record(summary_of(structure, kind, all), recorder);
}

void run_structure(const std::string& name, const SuiteOptions& options, Recorder& recorder) {
  const auto folder = std::filesystem::path(options.shared_folder) / "data" / "beams" / name;
  const beams::BeamModel model = testing::model_of(scene::read_beam_job_folder(folder));
  LiveBeams opened(model);
  const SolvedEdit solved = solve(opened, drawn_conditions(model));
  record(opening_of(name, solved), recorder);
  if (!solved.outcome.reached) return;
  const int count = options.quick ? 3 : 8;
  for (const EditKind& kind : kSmallKinds) run_kind(name, model, opened, kind, count, recorder);
  if (options.quick && name == "torus") return;
  for (const EditKind& kind : kEditKinds) run_kind(name, model, opened, kind, count, recorder);
}

void run_grid(const testing::BeamGrid& grid, const std::string& name, Recorder& recorder) {
  const beams::BeamModel model = testing::beam_grid(grid);
  LiveBeams live(model);
  const SolvedEdit solved = solve(live, drawn_conditions(model));
  Case result = opening_of(name, solved);
  result["number"] = model.elements.size();
  const Eigen::RowVectorXd z = live.state().positions.row(2);
  result["sag"] = -z.minCoeff();
  record(result, recorder);
}

}  // namespace

// $LIMBER_BENCH_ONLY: only structures whose names contain it.
void beam_edits_suite(const SuiteOptions& options, Recorder& recorder) {
  const int nodes = options.quick ? 31 : 71;
  using Held = testing::BeamGrid::Held;
  const std::pair<Held, const char*> holds[] = {
      {Held::kRim, "rim"}, {Held::kCorners, "corners"}, {Held::kRimClamped, "clamped rim"}};
  for (const auto& [held, where] : holds) {
    for (const double radius : {0.1, 0.01, 0.002}) {
      const std::string name = std::string("grid, radius ") + nlohmann::json(1e3 * radius).dump() +
                               " mm, held at " + where;
      if (is_selected(name)) run_grid({nodes, 20, radius, held}, name, recorder);
    }
  }
  if (options.shared_folder.empty() ||
      !std::filesystem::exists(std::filesystem::path(options.shared_folder) / "data" / "beams")) {
    recorder.note("the public structures are left out: no shared folder");
    return;
  }
  for (const char* name : {"roof", "torus"})
    if (is_selected(name)) run_structure(name, options, recorder);
}

}  // namespace limber::bench
