#include "engine/scene/tetrahedralize/graded_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>

#include "engine/scene/tetrahedralize/graded_lattice.h"
#include "engine/scene/tetrahedralize/smoothing.h"

namespace limber::scene::lattice {
namespace {

constexpr double kLargestCell = 0.2;  // share of the body's length
constexpr int kRungsPerHalving = 8;
constexpr int kMaxRung = 50;  // cells of 0.26 % of the body's length
/// Sides that a search for a sufficient number of tets tries, the same for any request: the found
/// number works when it is requested.
constexpr int kCoarseRungs[] = {0, 2, 4, 6};

/// Cells are split where the distance exceeds this share of the allowed one: smoothing takes a
/// little.
constexpr double kSplitShare = 0.8;

struct Trial {
  bool fits = false;
  std::size_t tets = 0;
  GradedMesh mesh;
  std::shared_ptr<GradedLattice> lattice;
};

class RungSearch {
 public:
  RungSearch(const SurfaceBody& body, const TetrahedralizeOptions& options)
      : body_(body),
        options_(options),
        length_(body.tree.bounds().diagonal().norm()),
        most_tets_(static_cast<std::size_t>(options.target_tets * (1 + options.count_tolerance))) {}

  [[nodiscard]] double side(int rung) const {
    return kLargestCell * length_ * std::exp2(-static_cast<double>(rung) / kRungsPerHalving);
  }

  /// The lattice with large cells of this rung, split until the mesh fits or has too many tets.
  Trial run(int rung, std::size_t max_tets, const JobContext& job) {
    constexpr int kMaxRounds = 16;
    Trial trial;
    trial.lattice = std::make_shared<GradedLattice>(body_.solid, side(rung));
    trial.mesh.cell_size = side(rung);
    for (int round = 0; round < kMaxRounds; ++round) {
      job.report("splitting cells", 1 - std::pow(0.75, round));
      rebuild(trial, job);
      if (trial.tets == 0) {
        if (!split_at_vertices(*trial.lattice)) return trial;
        continue;
      }
      if (trial.tets > max_tets) return trial;
      FitMeasurement now = measure(trial.mesh.stuffing, kSplitShare, job);
      note_share(trial, now.fit);
      if (now.gaps.empty()) {
        finish(trial, now, job);
        if (trial.fits) return trial;
      }
      if (!split_at(*trial.lattice, now.gaps, now.gaps.size())) return trial;
    }
    return trial;
  }

  /// Uses the remaining tets where the distance is largest.
  void fill(Trial& trial, const JobContext& job) {
    constexpr int kMaxRounds = 8;
    const auto target = static_cast<double>(options_.target_tets);
    Trial current;
    current.lattice = trial.lattice;
    current.mesh.cell_size = trial.mesh.cell_size;
    current.tets = trial.tets;
    current.mesh.stuffing = trial.mesh.stuffing;
    double tets_per_split = 60;
    for (int round = 0; round < kMaxRounds; ++round) {
      job.report("spending the rest of the tets", static_cast<double>(round) / kMaxRounds);
      const double missing = target - static_cast<double>(current.tets);
      if (missing < 0.05 * target) break;
      const FitMeasurement now = measure(current.mesh.stuffing, 0.3, job);
      Trial next;
      next.mesh.cell_size = trial.mesh.cell_size;
      next.lattice = std::make_shared<GradedLattice>(*current.lattice);
      const auto splits = static_cast<std::size_t>(std::max(1.0, 0.8 * missing / tets_per_split));
      const std::size_t done = split_at(*next.lattice, now.gaps, splits);
      if (done == 0) break;
      rebuild(next, job);
      const double gained = static_cast<double>(next.tets) - static_cast<double>(current.tets);
      tets_per_split = std::clamp(gained / static_cast<double>(done), 10.0, 2000.0);
      if (static_cast<double>(next.tets) < 1.04 * target) current = std::move(next);
    }
    if (current.tets == trial.tets) return;
    FitMeasurement last = measure(current.mesh.stuffing, 1, job);
    finish(current, last, job);
    if (current.fits) trial = std::move(current);
  }

  [[nodiscard]] bool is_enough(const Trial& trial) const {
    return trial.fits && trial.tets <= most_tets_;
  }
  [[nodiscard]] double nearest_share() const { return nearest_share_; }

 private:
  void rebuild(Trial& trial, const JobContext& job) const {
    trial.mesh.stuffing =
        trial.lattice->stuff(static_cast<std::size_t>(options_.max_lattice_points), job);
    trial.mesh.repair = make_one_piece(trial.mesh.stuffing);
    trial.tets = trial.mesh.stuffing.tets.size();
  }

  FitMeasurement measure(const Stuffing& stuffing, double share_of_within,
                         const JobContext& job) const {
    return measure_fit(body_.surface, body_.tree, as_mesh(stuffing), options_.within,
                       share_of_within * options_.within * length_, job);
  }

  /// Smooths what keeps the distance; `now` becomes the measurement after that.
  void finish(Trial& trial, FitMeasurement& now, const JobContext& job) {
    const JobContext quiet{job.cancellation, {}};
    smooth_graded(trial.mesh.stuffing, body_.solid, options_.smoothing_passes, quiet);
    now = measure(trial.mesh.stuffing, 0.95, job);
    note_share(trial, now.fit);
    trial.mesh.fit = now.fit;
    trial.fits = now.fit.distance_share <= options_.within;
  }

  void note_share(const Trial& trial, const SurfaceFit& fit) {
    if (trial.tets <= most_tets_) nearest_share_ = std::min(nearest_share_, fit.distance_share);
  }

  /// Splits the leaves of the widest gaps, `count` at most. @returns how many.
  static std::size_t split_at(GradedLattice& lattice, std::vector<Gap> gaps, std::size_t count) {
    std::stable_sort(gaps.begin(), gaps.end(),
                     [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
    // All leaves are looked up first: a place whose leaf was just split is not split again.
    std::vector<Octree::Cell> cells;
    std::set<std::uint64_t> chosen_keys;
    for (const Gap& gap : gaps) {
      if (cells.size() >= count) break;
      const Octree::Cell cell = lattice.octree().leaf_at(gap.at);
      if (chosen_keys.insert(lattice.octree().point_key(cell)).second) cells.push_back(cell);
    }
    std::size_t done = 0;
    for (const Octree::Cell& cell : cells) done += lattice.octree().split(cell) ? 1 : 0;
    return done;
  }
  [[nodiscard]] bool split_at_vertices(GradedLattice& lattice) const {
    std::vector<Gap> everywhere;
    for (int v = 0; v < body_.surface.vertex_count(); ++v) {
      everywhere.push_back({body_.surface.vertices.col(v), 0});
    }
    return split_at(lattice, everywhere, everywhere.size()) > 0;
  }

  const SurfaceBody& body_;
  const TetrahedralizeOptions& options_;
  double length_;
  std::size_t most_tets_;
  double nearest_share_ = 1;
};

/// Two digits, upward.
int rounded_up(std::size_t count) {
  double unit = 1;
  while (static_cast<double>(count) / unit > 100) unit *= 10;
  return static_cast<int>(std::ceil(static_cast<double>(count) / unit) * unit);
}

/// The smallest cells that do with the requested tets, searched downward from uniform ones.
Trial search_rungs(RungSearch& search, int first, int target_tets, const JobContext& job) {
  constexpr int kMaxTrials = 8;
  Trial best;
  int finest_tried = kMaxRung + 1;
  int rung = first;
  for (int n = 0; n < kMaxTrials && rung >= 0; ++n) {
    Trial trial = search.run(
        rung, 2 * static_cast<std::size_t>(target_tets),
        job.part(static_cast<double>(n) / kMaxTrials, static_cast<double>(n + 1) / kMaxTrials));
    const double ratio = static_cast<double>(trial.tets) / target_tets;
    const int steps =
        static_cast<int>(std::lround(kRungsPerHalving / 3.0 * std::log2(std::max(ratio, 1e-3))));
    const bool is_enough = search.is_enough(trial);
    const bool is_better = is_enough && trial.tets > best.tets;
    if (!is_enough) finest_tried = std::min(finest_tried, rung);
    if (is_better) best = std::move(trial);
    if (is_enough) {
      const int next = std::min(rung - steps, finest_tried - 1);
      if (next <= rung || ratio > 0.9) break;
      rung = next;
    } else if (best.tets > 0) {
      break;
    } else {
      rung -= std::max(1, steps);
    }
  }
  return best;
}

}  // namespace

GradedSearch search_graded(const SurfaceBody& body, const TetrahedralizeOptions& options,
                           double uniform_cell, const JobContext& job) {
  RungSearch search(body, options);
  GradedSearch result;
  const double rungs = kRungsPerHalving * std::log2(search.side(0) / uniform_cell);
  const int first = std::clamp(static_cast<int>(std::ceil(rungs)), 0, kMaxRung);
  Trial best = search_rungs(search, first, options.target_tets, job.part(0, 0.4));
  if (best.tets == 0) {
    // A sufficient number of tets. It is bounded, or a thin sheet would take all memory.
    std::size_t fewest = std::clamp<std::size_t>(20 * static_cast<std::size_t>(options.target_tets),
                                                 200'000, 5'000'000);
    result.searched_tets = static_cast<int>(fewest);
    double done = 0.4;
    for (const int rung : kCoarseRungs) {
      Trial trial = search.run(rung, fewest, job.part(done, done + 0.1));
      done += 0.1;
      if (!trial.fits) continue;
      fewest = trial.tets;
      result.needed_tets = rounded_up(fewest);
      if (search.is_enough(trial)) best = std::move(trial);
    }
  }
  result.nearest_share = search.nearest_share();
  if (best.tets == 0) return result;
  search.fill(best, job.part(0.8, 1));
  result.is_found = true;
  result.best = std::move(best.mesh);
  return result;
}

}  // namespace limber::scene::lattice
