#include "bench/design_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

namespace limber::bench {
namespace {

/// Have all joints their closest points on the same faces and edges of the surface, which the
/// points' derivatives tell? From one of these to another J's second derivatives jump, and where
/// two points are equally close, its first ones too: no difference across tells derivatives.
bool same_faces(const rods::TargetSurface& surface, const rods::DesignPoint& a,
                const rods::DesignPoint& b) {
  constexpr double kSame = 1e-9;
  const auto &first = a.deployed.joints(), &second = b.deployed.joints();
  for (std::size_t j = 0; j < first.size(); ++j) {
    const Eigen::Matrix3d change = surface.closest(first[j].position).derivative -
                                   surface.closest(second[j].position).derivative;
    if (change.cwiseAbs().maxCoeff() > kSame) return false;
  }
  return true;
}

/// The differentiated functions, and the names of their checks.
struct Measure {
  const char* name;
  double rods::DesignMeasures<double>::*value;
  Eigen::VectorXd rods::DesignMeasures<Eigen::VectorXd>::*derivative;
};
constexpr Measure kMeasures[] = {{"", &rods::DesignMeasures<double>::objective,
                                  &rods::DesignMeasures<Eigen::VectorXd>::objective},
                                 {"_flatness", &rods::DesignMeasures<double>::flatness,
                                  &rods::DesignMeasures<Eigen::VectorXd>::flatness},
                                 {"_angle", &rods::DesignMeasures<double>::smallest_angle,
                                  &rods::DesignMeasures<Eigen::VectorXd>::smallest_angle},
                                 {"_area", &rods::DesignMeasures<double>::deployed_area,
                                  &rods::DesignMeasures<Eigen::VectorXd>::deployed_area}};

struct Mismatch {
  bool has_differences = false;  // with some step
  /// Relative, of each measure; empty: no differences could be taken, or it has no derivative to
  /// compare with.
  std::array<std::optional<double>, std::size(kMeasures)> gradient, product;
  std::optional<rods::DesignPoint> beside;  // the farthest trial along the direction
};

/// Values and gradients at p + h v, p - h v, and where that is trusted p + 2 h v and p - 2 h v.
struct Sides {
  std::vector<rods::DesignValues> values;
  std::vector<rods::DesignMeasures<Eigen::VectorXd>> gradients;
};

/// Leaves the design where it was.
/// @param beside  gets the first trial's point, where that is found and it has none
std::optional<Sides> sides_of(rods::LinkageDesign& design, const Eigen::VectorXd& v, double step,
                              std::optional<rods::DesignPoint>& beside) {
  const rods::DesignPoint home = design.point();
  const Eigen::VectorXd parameters = design.parameters();
  std::vector<rods::DesignPoint> points;
  for (const double side : {1.0, -1.0, 2.0, -2.0}) {
    rods::DesignTrial trial = design.trial(parameters + side * step * v);
    if (trial.status != rods::TrialStatus::kFound) break;
    if (!beside) beside = trial.point;
    if (!same_faces(*design.criteria().surface, home, trial.point)) break;
    points.push_back(std::move(trial.point));
  }
  if (points.size() < 2) return {};
  if (points.size() < 4) points.erase(points.begin() + 2, points.end());
  Sides sides;
  for (const rods::DesignPoint& point : points) {
    sides.values.push_back(design.values(point));
    design.move_to(point);
    sides.gradients.push_back(design.gradients());
  }
  design.move_to(home);
  return sides;
}

/// Against differences of second and fourth order of equilibria solved again, the best of a ladder
/// of steps: long ones bend, short ones drown in rounding.
/// @param v  along which, of the size of the parameters
Mismatch differences(rods::LinkageDesign& design, const Eigen::VectorXd& v,
                     const std::vector<double>& steps) {
  const rods::DesignMeasures<Eigen::VectorXd> gradients = design.gradients();
  const rods::DesignMeasures<Eigen::VectorXd> products = design.products(v);
  Mismatch best;
  constexpr double kNothing = 1e-8;  // of a radian, of the objective, of squared lengths
  const double length = design.criteria().length_scale;
  const std::array<double, std::size(kMeasures)> units{design.values(design.point()).objective,
                                                       length * length, 1, length * length};
  for (const double step : steps) {
    const std::optional<Sides> sides = sides_of(design, v, step, best.beside);
    if (!sides) continue;
    best.has_differences = true;
    for (std::size_t m = 0; m < std::size(kMeasures); ++m) {
      const Eigen::VectorXd& gradient = gradients.*kMeasures[m].derivative;
      const Eigen::VectorXd& product = products.*kMeasures[m].derivative;
      const auto value = [&](std::size_t k) { return sides->values[k].*kMeasures[m].value; };
      const auto slope = [&](std::size_t k) -> const Eigen::VectorXd& {
        return sides->gradients[k].*kMeasures[m].derivative;
      };
      const auto compare = [&](double change, const Eigen::VectorXd& turn) {
        const auto note = [&](std::optional<double>& least, double mismatch, double size) {
          if (size * v.norm() <= kNothing * units[m]) return;
          least = std::min(least.value_or(mismatch / size), mismatch / size);
        };
        note(best.gradient[m], std::abs(change - gradient.dot(v)) / v.norm(), gradient.norm());
        note(best.product[m], (turn - product).norm(), product.norm());
      };
      compare((value(0) - value(1)) / (2 * step), (slope(0) - slope(1)) / (2 * step));
      if (sides->values.size() < 4) continue;
      compare((8 * (value(0) - value(1)) - (value(2) - value(3))) / (12 * step),
              (8 * (slope(0) - slope(1)) - (slope(2) - slope(3))) / (12 * step));
    }
  }
  return best;
}

}  // namespace

void check_derivatives(rods::LinkageDesign& design, Eigen::VectorXd v, bool quick,
                       const std::string& kind, Case& result) {
  const std::vector<double> steps = quick ? std::vector<double>{1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 3e-7}
                                          : std::vector<double>{1e-2, 3e-3, 1e-3, 3e-4, 2e-4, 1e-4,
                                                                5e-5, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7};
  const rods::DesignPoint home = design.point();
  v *= design.parameters().mean() / v.norm();
  Mismatch mismatch = differences(design, v, steps);
  const bool crease = !mismatch.has_differences && mismatch.beside;
  if (crease) {  // J has no derivative here: next to it, it has
    design.move_to(*mismatch.beside);
    mismatch = differences(design, v, steps);
    design.move_to(home);
  }
  const auto json_value = [](const std::optional<double>& value) {
    return value ? Case(*value) : Case(nullptr);
  };
  for (std::size_t m = 0; m < std::size(kMeasures); ++m) {
    result[std::string("gradient_check") + kMeasures[m].name + kind] =
        json_value(mismatch.gradient[m]);
    result[std::string("hessvec_check") + kMeasures[m].name + kind] =
        json_value(mismatch.product[m]);
  }
  result["off_crease" + kind] = crease;
}

}  // namespace limber::bench
