// How soon a session of a linkage answers while a target is dragged: the domes of growth_linkages,
// opened by 10 degrees, and hourglass, deployed. A mouse leads the target of one joint once around
// a circle, a move for each picture of a screen. `edits`: "waited", each move after the final
// result of the one before; or "60 Hz", without waiting, so that moves interrupt solves.
//
// `first_ms`, `first_most_ms`: from a move to the first shape that knows of it, median and largest
// but for one in twenty; `final_ms` (waited): to its equilibrium. `shown`: share of moves of which
// a shape was shown before the next one. `correction_error`: how far the first shape of a move is
// from its equilibrium, the worst vertex, medians. It is a share of how far it is led there from
// the equilibrium of the move before (waited), or of the linkage's size (60 Hz). `moved` (60 Hz):
// how far the equilibrium is from the start of the drag. `last_off`: the last equilibrium of both
// runs, share of the size. `failed`: moves without an equilibrium. --quick moves three times as far
// at once.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>

#include "bench/dome_lines.h"
#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/rods/linkage/drawn_extent.h"
#include "engine/scene/formats/line_formats.h"
#include "engine/session/linkages/session.h"

namespace limber::bench {
namespace {

using Clock = std::chrono::steady_clock;
using session::LinkageResult;
using SharedResult = std::shared_ptr<const LinkageResult>;

constexpr std::chrono::microseconds kPicture{16667};
constexpr double kRadius = 0.03;  // of the circle, share of the linkage's size
constexpr std::chrono::minutes kDragPatience{5};

double since_ms(Clock::time_point then) {
  return std::chrono::duration<double, std::milli>(Clock::now() - then).count();
}

/// Threads that sessions run on.
class Workers {
 public:
  explicit Workers(int count) {
    for (int i = 0; i < count; ++i) threads_.emplace_back([this] { loop(); });
  }
  ~Workers() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  [[nodiscard]] session::Executor executor() {
    return [this](std::function<void()> task) {
      {
        const std::lock_guard lock(mutex_);
        tasks_.push_back(std::move(task));
      }
      wake_.notify_one();
    };
  }

 private:
  void loop() {
    for (;;) {
      std::function<void()> task;
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [this] { return is_over_ || !tasks_.empty(); });
        if (tasks_.empty()) return;
        task = std::move(tasks_.front());
        tasks_.pop_front();
      }
      task();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

/// First and last shape of each revision.
class Watch : public session::LinkageListener {
 public:
  struct Seen {
    Clock::time_point at;
    SharedResult first, final;
  };

  void on_progress(const session::Progress&) override {}
  void on_state(session::State, const std::string&) override {}
  void on_result(const SharedResult& result) override {
    const std::lock_guard lock(mutex_);
    Seen& seen = seen_[result->revision];
    if (!seen.first) {
      seen.at = Clock::now();
      seen.first = result;
    }
    if (result->is_final && !seen.final) seen.final = result;
    changed_.notify_all();
  }
  SharedResult wait_final(session::Revision revision) {
    std::unique_lock lock(mutex_);
    const auto is_there = [&] { return seen_[revision].final != nullptr; };
    if (!changed_.wait_for(lock, kDragPatience, is_there))
      throw std::runtime_error("no final result came");
    return seen_[revision].final;
  }
  /// Null where nothing came of it.
  [[nodiscard]] Seen seen(session::Revision revision) {
    const std::lock_guard lock(mutex_);
    return seen_[revision];
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<session::Revision, Seen> seen_;
};

struct Dragged {
  std::string name;
  scene::Linkage linkage;
  int held = 0;           // joint that stays
  double mean_angle = 0;  // that it is opened to [rad]; 0: by 10 degrees
};

/// The largest distance between vertices of two shapes: of each segment they stand before the
/// directions of its edges.
double farthest(const std::vector<int>& edges, const LinkageResult& a, const LinkageResult& b) {
  const Eigen::VectorXd apart = a.frames->rightCols<1>() - b.frames->rightCols<1>();
  double largest = 0;
  Eigen::Index at = 0;
  for (const int count : edges) {
    for (int i = 0; i <= count; ++i)
      largest = std::max(largest, apart.segment<3>(at + 3 * Eigen::Index{i}).norm());
    at += 6 * Eigen::Index{count} + 3;
  }
  return largest;
}

class Drag {
 public:
  Drag(const Dragged& dragged, int moves)
      : moves_(moves), session_("drag", dragged.linkage, {}, workers_.executor(), watch_) {
    const SharedResult drawn = watch_->wait_final(0);
    session::SetMeanAngle open{dragged.mean_angle > 0 ? dragged.mean_angle
                                                      : drawn->mean_angle + 10 * kDegree};
    (void)edit({session::PinJoint{dragged.held, scene::Held::kMotion}, open});
    const auto& joints = session_.final_result()->state->joints();
    const rods::LinkageModel& model = session_.statics()->model();
    size_ = rods::drawn_extent(model.graph());
    // Stiff compared with the linkage's resistance at a joint: the joint follows the mouse.
    const double edge = model.rest_lengths().free_edge.mean();
    const double bending = std::min(model.stiffness().bending_1, model.stiffness().bending_2);
    const auto count = static_cast<int>(joints.size());
    for (const int joint : {count / 4, 3 * count / 4}) {
      scene::LinkageTarget target;
      target.joint = joint;
      target.position = joints[static_cast<std::size_t>(joint)].position;
      target.stiffness =
          300 * bending / std::pow(10 * edge, 3) / dragged.linkage.length_unit_in_metres;
      (void)edit({session::AddTarget{target}});
    }
    home_ = joints[static_cast<std::size_t>(count / 4)].position;
    unknowns_ = model.variables().size();
    joints_ = count;
    edges_ = session_.geometry()->edges;
  }

  Case waited() {
    std::vector<double> first, final, error;
    int failed = 0;
    SharedResult before = session_.final_result();
    for (int i = 0; i < moves_; ++i) {
      const auto start = Clock::now();
      const session::Revision revision = move(i);
      const SharedResult found = watch_->wait_final(revision);
      final.push_back(since_ms(start));
      const Watch::Seen seen = watch_->seen(revision);
      first.push_back(std::chrono::duration<double, std::milli>(seen.at - start).count());
      error.push_back(farthest(edges_, *seen.first, *found) / farthest(edges_, *before, *found));
      failed += found->solve_failed ? 1 : 0;
      finals_.push_back(before = found);
    }
    Case row = row_of("waited", first);
    row["final_ms"] = median(final);
    row["correction_error"] = median(error);
    row["failed"] = failed;
    return row;
  }

  /// @pre waited()
  Case at_60_hz() {
    std::vector<double> first, error, moved;
    const SharedResult home = session_.final_result();
    std::vector<std::pair<session::Revision, Clock::time_point>> moves;
    Clock::time_point next = Clock::now();
    for (int i = 0; i < moves_; ++i, next += kPicture) {
      std::this_thread::sleep_until(next);
      const auto start = Clock::now();
      moves.emplace_back(move(i), start);
    }
    const SharedResult last = watch_->wait_final(moves.back().first);
    int shown = 0;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const Watch::Seen seen = watch_->seen(moves[i].first);
      if (!seen.first) continue;
      ++shown;
      first.push_back(std::chrono::duration<double, std::milli>(seen.at - moves[i].second).count());
      error.push_back(farthest(edges_, *seen.first, *finals_[i]) / size_);
      moved.push_back(farthest(edges_, *home, *finals_[i]) / size_);
    }
    Case row = row_of("60 Hz", first);
    row["final_ms"] = nullptr;
    row["correction_error"] = median(error);
    row["failed"] = last->solve_failed ? 1 : 0;
    row["shown"] = static_cast<double>(shown) / moves_;
    row["moved"] = median(moved);
    row["last_off"] = farthest(edges_, *last, *finals_.back()) / size_;
    return row;
  }

  std::string name;

 private:
  SharedResult edit(const std::vector<session::LinkageEdit>& edits) {
    SharedResult found = watch_->wait_final(session_.edit(edits).revision);
    if (found->solve_failed) throw std::runtime_error(name + ": " + found->report.message);
    return found;
  }

  /// The i-th move of the mouse.
  session::Revision move(int i) {
    const double turn = 2 * std::numbers::pi * (i + 1) / moves_;
    const Eigen::Vector3d beside(1 - std::cos(turn), 0, std::sin(turn));
    return session_.edit({session::MoveTarget{1, home_ + kRadius * size_ * beside}}).revision;
  }

  Case row_of(const char* edits, const std::vector<double>& first) const {
    Case row;
    row["joints"] = joints_;
    row["unknowns"] = unknowns_;
    row["edits"] = edits;
    row["moves"] = moves_;
    row["first_ms"] = median(first);
    row["first_most_ms"] = quantile(first, 0.95);
    return row;
  }

  const int moves_;
  Workers workers_{2};
  std::shared_ptr<Watch> watch_ = std::make_shared<Watch>();
  session::LinkageSession session_;
  Eigen::Vector3d home_ = Eigen::Vector3d::Zero();
  double size_ = 1;
  int unknowns_ = 0, joints_ = 0;
  std::vector<int> edges_;  // of each segment
  std::vector<SharedResult> finals_;
};

Dragged dome(int rods) {
  Dragged dragged;
  dragged.name = fmt::format("dome {}", rods);
  dragged.linkage.lines = dome_lines(rods);
  dragged.linkage.section = rods::Rectangle{0.01, 0.005};
  dragged.held = rods * rods / 2;
  return dragged;
}

Dragged hourglass(const std::string& path, const LinkageCase& named) {
  Dragged dragged;
  dragged.name = named.name;
  dragged.linkage.lines = scene::read_line_mesh_file(path);
  dragged.linkage.length_unit_in_metres = 1e-3;
  dragged.linkage.youngs_modulus = 2e9;
  dragged.linkage.section = rods::Rectangle{12, 8};
  dragged.linkage.edges_per_segment = named.edges;
  dragged.held = named.held;
  dragged.mean_angle = named.target * kDegree;
  return dragged;
}

void drag(const Dragged& dragged, int moves, Recorder& recorder) {
  if (!is_selected(dragged.name)) return;
  recorder.note(fmt::format("linkage_drag: {}", dragged.name));
  Drag drag(dragged, moves);
  for (Case row : {drag.waited(), drag.at_60_hz()}) {
    Case named;
    named["linkage"] = dragged.name;
    named.update(row);
    recorder.add(named);
  }
}

}  // namespace

void linkage_drag_suite(const SuiteOptions& options, Recorder& recorder) {
  const int moves = options.quick ? 30 : 90;
  for (const int rods : {9, 15, 21, 29}) drag(dome(rods), moves, recorder);
  const LinkageCase& named = linkage_case("hourglass");
  if (const auto path = find_linkage_lines(options, named.name, named.file, recorder))
    drag(hourglass(*path, named), moves, recorder);
}

}  // namespace limber::bench
