#include "engine/scene/tetrahedralize/tetrahedralize.h"

#include <cmath>
#include <limits>

#include "engine/scene/tetrahedralize/lattice.h"
#include "engine/scene/tetrahedralize/repair.h"
#include "engine/scene/tetrahedralize/smoothing.h"
#include "engine/scene/tetrahedralize/triangle_tree.h"

namespace limber::scene {
namespace {

struct Candidate {
  double cell = 0;
  double misfit = std::numeric_limits<double>::infinity();  // |log(tets / target)|
  lattice::Stuffing stuffing;
  lattice::Repair repair;
};

void check(const ImplicitSolid& solid) {
  if (!solid.distance)
    throw Error(ErrorCode::kInvalidArgument, "", "the solid has no distance function");
  const bool finite = solid.bounds.min().allFinite() && solid.bounds.max().allFinite();
  if (!finite || !((solid.bounds.sizes().array() > 0).all())) {
    throw Error(ErrorCode::kInvalidArgument, "",
                "the bounding box of the solid is empty or not finite");
  }
  if (!(solid.lipschitz > 0) || !std::isfinite(solid.lipschitz)) {
    throw Error(ErrorCode::kInvalidArgument, "lipschitz", "lipschitz must be > 0 and finite");
  }
}

Candidate stuff_with(double cell, const Eigen::Vector3d& phase, const ImplicitSolid& solid,
                     const TetrahedralizeOptions& options, const JobContext& job) {
  Candidate candidate;
  candidate.cell = cell;
  candidate.stuffing = lattice::stuff(solid, cell, phase, options.max_lattice_points, job);
  candidate.repair = lattice::make_one_piece(candidate.stuffing);
  const auto count = static_cast<double>(candidate.stuffing.tets.size());
  if (count > 0) candidate.misfit = std::abs(std::log(count / options.target_tets));
  return candidate;
}

/// Searches the cell size: the number of tets falls about with the cube of it, but not smoothly, so
/// the best seen wins.
Candidate search(const ImplicitSolid& solid, const TetrahedralizeOptions& options,
                 const JobContext& job) {
  constexpr int kMaxRounds = 18;
  constexpr int kCentredRounds = 8;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double close_enough = std::log1p(options.count_tolerance) * 0.7;
  // First guess: the body fills a fifth of its box, a cell has twelve tets.
  double cell = std::cbrt(0.2 * 12 * solid.bounds.volume() / options.target_tets);
  double too_coarse = kInfinity;  // smallest cell known to give too few tets
  double too_fine = 0;            // largest cell known to give too many
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();
  Candidate best;
  for (int round = 0; round < kMaxRounds; ++round) {
    job.report("searching the cell size", static_cast<double>(round) / kMaxRounds);
    Candidate candidate = stuff_with(cell, phase, solid, options, job);
    const double count = static_cast<double>(candidate.stuffing.tets.size());
    const double log_ratio = count > 0 ? std::log(count / options.target_tets) : -std::log(8.0);
    (log_ratio < 0 ? too_coarse : too_fine) = cell;
    if (candidate.misfit < best.misfit) best = std::move(candidate);
    if (best.misfit <= close_enough) break;
    if (count == 0 && lattice::lattice_points(solid, cell) > 2e6)
      break;  // there seems to be nothing
    if (round + 1 == kCentredRounds) {
      // Flat sides along the axes make the count jump: all of them pass lattice points at the same
      // cell sizes. A shifted lattice takes them one by one.
      phase = {0.31, 0.17, 0.43};
      too_coarse = kInfinity;
      too_fine = 0;
    }
    double next = cell * std::exp(log_ratio / 3);
    // Stay inside of the bracket; the count is not quite monotonic, so an inverted bracket is
    // forgotten.
    if (too_fine >= too_coarse) {
      (log_ratio < 0 ? too_fine : too_coarse) = log_ratio < 0 ? 0 : kInfinity;
    }
    if (std::isfinite(too_coarse) && too_fine > 0 && (next <= too_fine || next >= too_coarse)) {
      next = std::sqrt(too_fine * too_coarse);
    }
    if (std::abs(next / cell - 1) < 1e-9) break;
    cell = next;
  }
  return best;
}

}  // namespace

void TetrahedralizeOptions::validate() const {
  const auto refuse = [](const char* field, const std::string& rule) {
    throw Error(ErrorCode::kInvalidArgument, field, std::string(field) + " must be " + rule);
  };
  if (target_tets < 50 || target_tets > 5'000'000) {
    refuse("target_tets", "in [50, 5000000], is " + std::to_string(target_tets));
  }
  if (!(cell_size >= 0) || !std::isfinite(cell_size)) refuse("cell_size", ">= 0 and finite");
  if (!(count_tolerance > 0 && count_tolerance < 1)) refuse("count_tolerance", "in (0, 1)");
  if (smoothing_passes < 0)
    refuse("smoothing_passes", ">= 0, is " + std::to_string(smoothing_passes));
  if (max_lattice_points <= 0)
    refuse("max_lattice_points", "> 0, is " + std::to_string(max_lattice_points));
}

Tetrahedralization tetrahedralize(const ImplicitSolid& solid, const TetrahedralizeOptions& options,
                                  const JobContext& job) {
  options.validate();
  check(solid);
  const bool given = options.cell_size > 0;
  Candidate best = given
                       ? stuff_with(options.cell_size, Eigen::Vector3d::Zero(), solid, options, job)
                       : search(solid, options, job.part(0, 0.7));
  if (!std::isfinite(best.misfit)) {
    throw Error(ErrorCode::kNumerical, "",
                "no cell size gives a single tet: the body is empty or far too thin");
  }
  lattice::smooth(best.stuffing, solid, best.cell, options.smoothing_passes, job.part(0.7, 1));

  Tetrahedralization result;
  const lattice::Stuffing& stuffing = best.stuffing;
  result.cell_size = best.cell;
  result.mesh.nodes.resize(3, static_cast<Eigen::Index>(stuffing.nodes.size()));
  for (std::size_t i = 0; i < stuffing.nodes.size(); ++i) {
    result.mesh.nodes.col(static_cast<Eigen::Index>(i)) = stuffing.nodes[i];
  }
  result.mesh.tets.resize(4, static_cast<Eigen::Index>(stuffing.tets.size()));
  for (std::size_t t = 0; t < stuffing.tets.size(); ++t) {
    result.mesh.tets.col(static_cast<Eigen::Index>(t)) = stuffing.tets[t];
  }
  result.quality = measure_quality(result.mesh);
  if (best.repair.pieces_dropped > 0) {
    result.notes.push_back("only the largest piece is kept; " +
                           std::to_string(best.repair.pieces_dropped) +
                           " smaller pieces are left out");
  }
  if (best.repair.nodes_separated > 0) {
    result.notes.push_back(std::to_string(best.repair.nodes_separated) +
                           " nodes where parts only touched are separated");
  }
  if (best.repair.tets_dropped > 0) {
    result.notes.push_back(std::to_string(best.repair.tets_dropped) +
                           " tets of smaller pieces or touching edges are left out");
  }
  if (!given && best.misfit > std::log1p(options.count_tolerance)) {
    result.notes.push_back("the nearest number of tets found is " +
                           std::to_string(result.mesh.tet_count()) + ", not " +
                           std::to_string(options.target_tets));
  }
  return result;
}

Tetrahedralization tetrahedralize(const TriangleSurface& surface,
                                  const TetrahedralizeOptions& options, const JobContext& job) {
  options.validate();
  job.report("indexing the surface", 0);
  const TriangleSurface closed = closed_outward(surface);
  const lattice::TriangleTree tree(closed);
  ImplicitSolid solid;
  solid.distance = [&tree](const Eigen::Vector3d& x) { return tree.signed_distance(x); };
  solid.bounds = tree.bounds();
  // A flat side of the box must not coincide with lattice points.
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(1e-3 * solid.bounds.diagonal().norm());
  solid.bounds = Eigen::AlignedBox3d(solid.bounds.min() - margin, solid.bounds.max() + margin);
  Tetrahedralization result = tetrahedralize(solid, options, job.part(0.05, 1));
  result.notes.insert(result.notes.begin(), closed.warnings.begin(), closed.warnings.end());
  return result;
}

}  // namespace limber::scene
