#include "engine/scene/tetrahedralize/tetrahedralize.h"

#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>

#include "engine/scene/tetrahedralize/graded_search.h"
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

Candidate uniform(const ImplicitSolid& solid, const TetrahedralizeOptions& options,
                  const JobContext& job) {
  const bool is_given = options.cell_size > 0;
  Candidate best = is_given
                       ? stuff_with(options.cell_size, Eigen::Vector3d::Zero(), solid, options, job)
                       : search(solid, options, job.part(0, 0.7));
  if (!std::isfinite(best.misfit)) {
    throw Error(ErrorCode::kNumerical, "",
                "no cell size gives a single tet: the body is empty or far too thin");
  }
  lattice::smooth(best.stuffing, solid, best.cell, options.smoothing_passes, job.part(0.7, 1));
  return best;
}

Tetrahedralization finished(const lattice::Stuffing& stuffing, const lattice::Repair& repair,
                            double cell, const TetrahedralizeOptions& options) {
  Tetrahedralization result;
  result.cell_size = cell;
  result.mesh = lattice::as_mesh(stuffing);
  result.quality = measure_quality(result.mesh);
  if (repair.pieces_dropped > 0) {
    result.notes.push_back("only the largest piece is kept; " +
                           std::to_string(repair.pieces_dropped) + " smaller pieces are left out");
  }
  if (repair.nodes_separated > 0) {
    result.notes.push_back(std::to_string(repair.nodes_separated) +
                           " nodes where parts only touched are separated");
  }
  if (repair.tets_dropped > 0) {
    result.notes.push_back(std::to_string(repair.tets_dropped) +
                           " tets of smaller pieces or touching edges are left out");
  }
  const double misfit =
      std::abs(std::log(static_cast<double>(result.mesh.tet_count()) / options.target_tets));
  if (!(options.cell_size > 0) && misfit > std::log1p(options.count_tolerance)) {
    result.notes.push_back("the nearest number of tets found is " +
                           std::to_string(result.mesh.tet_count()) + ", not " +
                           std::to_string(options.target_tets));
  }
  return result;
}

std::string percent(double share) {
  std::ostringstream text;
  text << std::setprecision(3) << 100 * share << " %";
  return text.str();
}

[[noreturn]] void refuse_distance(const lattice::SurfaceBody& body,
                                  const TetrahedralizeOptions& options, double nearest_share,
                                  const lattice::GradedSearch& search) {
  std::string advice;
  const double length = body.tree.bounds().diagonal().norm();
  if (lattice::has_far_part(body.surface, options.within * length)) {
    advice =
        "The surface has separate parts, of which only the largest is filled: no number of tets "
        "keeps it";
  } else if (search.needed_tets > 0) {
    advice = "About " + std::to_string(search.needed_tets) + " tets keep it";
  } else {
    advice = "More than " + std::to_string(search.searched_tets) + " tets would be needed";
  }
  throw Error(ErrorCode::kLimitExceeded, "within",
              std::to_string(options.target_tets) + " tets come within " + percent(nearest_share) +
                  " of the surface (share of the body's length), not " + percent(options.within) +
                  ". " + advice + "; or allow a larger distance.");
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
  if (!(within > 0 && within <= 1)) refuse("within", "in (0, 1]: a share of the body's length");
}

Tetrahedralization tetrahedralize(const ImplicitSolid& solid, const TetrahedralizeOptions& options,
                                  const JobContext& job) {
  options.validate();
  check(solid);
  const Candidate best = uniform(solid, options, job);
  return finished(best.stuffing, best.repair, best.cell, options);
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
  const lattice::SurfaceBody body{closed, tree, solid};
  constexpr double kNothing = std::numeric_limits<double>::infinity();

  Tetrahedralization result;
  const double most_tets = options.target_tets * (1 + options.count_tolerance);
  double nearest_share = 1;
  // First guess of a cell where one size gives nothing, as in the search for one.
  double cell = std::cbrt(0.2 * 12 * solid.bounds.volume() / options.target_tets);
  try {
    const Candidate best = uniform(solid, options, job.part(0.05, 0.45));
    result = finished(best.stuffing, best.repair, best.cell, options);
    cell = best.cell;
  } catch (const Error& error) {
    // Cells of several sizes may still do.
    const bool is_too_thin =
        error.code() == ErrorCode::kNumerical || error.code() == ErrorCode::kLimitExceeded;
    if (!is_too_thin || options.cell_size > 0 || options.within >= 1) throw;
  }
  if (result.mesh.tet_count() > 0) {
    job.report("measuring the distance", 0.45);
    result.fit = lattice::measure_fit(closed, tree, result.mesh, options.within, kNothing, job).fit;
    if (result.mesh.tet_count() <= most_tets) nearest_share = result.fit->distance_share;
  }
  const bool is_near = result.fit && result.fit->distance_share <= options.within &&
                       (options.within >= 1 || result.mesh.tet_count() <= most_tets);
  if (!is_near && !(options.cell_size > 0)) {
    lattice::GradedSearch graded;
    if (!lattice::has_far_part(closed, options.within * tree.bounds().diagonal().norm()))
      graded = search_graded(body, options, cell, job.part(0.5, 1));
    if (!graded.is_found)
      refuse_distance(body, options, std::min(nearest_share, graded.nearest_share), graded);
    result = finished(graded.best.stuffing, graded.best.repair, graded.best.cell_size, options);
    result.fit = graded.best.fit;
  }
  result.notes.insert(result.notes.begin(), closed.warnings.begin(), closed.warnings.end());
  return result;
}

}  // namespace limber::scene
