#include "engine/rods/equilibrium/unknown_scales.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace limber::rods::detail {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 8 * kEpsilon;  // of a difference of coordinates, with later operations

constexpr double square(double x) { return x * x; }

}  // namespace

UnknownScales::UnknownScales(const LinkageModel& model)
    : weights_(Eigen::VectorXd::Zero(model.variables().size())),
      kinds_(static_cast<std::size_t>(model.variables().size()), UnknownKind::kAngle) {
  const ReducedVariables& variables = model.variables();
  const LinkageGraph& graph = model.graph();
  const RodStiffness& stiffness = model.stiffness();
  const double typical = model.rest_lengths().free_edge.mean();
  const auto weight = [&](double length) { return typical * typical / length; };
  // Scaled sections: E A goes with the square, bending with its square.
  const Eigen::ArrayXd areas = model.section_scales().array().square();
  const auto turning_radius = [&](int segment) {  // squared, of its section
    return areas[segment] * (stiffness.bending_1 + stiffness.bending_2) / stiffness.stretching;
  };
  std::vector<double> joint_radius(static_cast<std::size_t>(variables.joints()), 0.0);
  double shortest = std::numeric_limits<double>::infinity();
  int edges = 0;
  Eigen::Vector3d low = graph.segments[0].points[0];
  Eigen::Vector3d high = low;
  for (int s = 0; s < variables.segments(); ++s) {
    for (const Eigen::Vector3d& point : graph.segments[s].points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    const int begin = variables.chain_begin(s);
    const double free = model.rest_lengths().free_edge[s];
    shortest = std::min(shortest, free);
    for (int i = 0; i <= variables.edges(s); ++i) {
      const int position = variables.position(s, i);
      if (position >= 0) {
        weights_.segment<3>(position).setConstant(weight(free));
        std::fill_n(kinds_.begin() + position, 3, UnknownKind::kLength);
      }
      const int angle = i < variables.edges(s) ? variables.angle(s, i) : -1;
      if (angle >= begin) weights_[angle] = weight(free) * turning_radius(s);
    }
    for (const int joint : graph.segments[s].joints) {
      if (joint >= 0) joint_radius[joint] = std::max(joint_radius[joint], turning_radius(s));
    }
    edges += variables.edges(s);
    total_length_ += graph.segments[s].length;
  }
  for (int j = 0; j < variables.joints(); ++j) {
    const int begin = variables.joint_begin(j);
    const auto terminal = model.rest_lengths().terminal.col(j);
    const double mass = weight(terminal[0]) + weight(terminal[1]);
    const double square = terminal.squaredNorm() / 8;
    weights_.segment<3>(begin + kJointPosition).setConstant(mass);
    weights_.segment<3>(begin + kJointRotation).setConstant(mass * (square + joint_radius[j]));
    weights_[begin + kJointAngle] = mass * square / 4;
    weights_.segment<2>(begin + kJointLengthA).setConstant(mass / 4);
    for (const int unknown : {0, 1, 2, int{kJointLengthA}, int{kJointLengthB}})
      kinds_[begin + unknown] = UnknownKind::kLength;
  }
  extent_ = (high - low).norm();
  segment_ = total_length_ / variables.segments();
  edge_ = total_length_ / edges;
  const double thinnest = areas.minCoeff(), thickest = areas.maxCoeff();
  stretching_ = stiffness.stretching * thickest;
  bending_ = std::min(stiffness.bending_1, stiffness.bending_2) * thinnest * thinnest;
  stiffest_bending_ = std::max(stiffness.bending_1, stiffness.bending_2) * thickest * thickest;
  softest_ = bending_ / std::pow(extent_, 4);
  farthest_ = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  // Weights grow as edges shorten, as stretching stiffness does; bending's grows faster.
  rounding_shift_ =
      1e-6 * softest_ + 4 * kEpsilon * (stretching_ + stiffest_bending_ / (shortest * shortest)) /
                            (typical * typical);
  fill_rounding(model);
}

/// Differences of coordinates lose digits with the distance from the origin. Edges count one by
/// one, since a short one says nothing of long ones elsewhere. Forces by the turn of the shorter
/// edge at a vertex between two act on the ends of both.
void UnknownScales::fill_rounding(const LinkageModel& model) {
  const ReducedVariables& variables = model.variables();
  rounding_ = rounding_per_distance_ = Eigen::VectorXd::Zero(variables.size());
  for (int s = 0; s < variables.segments(); ++s) {
    const Segment& segment = model.graph().segments[s];
    const int edges = variables.edges(s);
    const auto length = [&](int e) {
      return model.rest_lengths().edge(model.graph(), variables, s, e);
    };
    const auto allow = [&](int unknown, double size, double shortest) {
      rounding_[unknown] += (1 + farthest_ / shortest) * size;
      rounding_per_distance_[unknown] += size / shortest;
    };
    const auto allow_joint = [&](int joint, double force, double moment, double shortest) {
      const int begin = variables.joint_begin(joint);
      for (int k = begin; k < begin + kJointUnknowns; ++k)
        allow(k, kinds_[k] == UnknownKind::kAngle ? moment : force, shortest);
    };
    const auto allow_vertex = [&](int i, double force, double shortest) {
      const int position = variables.position(s, i);
      if (position >= 0) {
        for (int k = position; k < position + 3; ++k) allow(k, force, shortest);
      } else if (i <= 1 && segment.joints[kStart] >= 0) {
        allow_joint(segment.joints[kStart], force, force * length(0), shortest);
      } else {
        allow_joint(segment.joints[kFinish], force, force * length(edges - 1), shortest);
      }
    };
    const auto allow_angle = [&](int e, double moment, double shortest) {
      const int angle = variables.angle(s, e);
      if (angle >= 0) {
        allow(angle, moment, shortest);
      } else {
        allow_joint(segment.joints[e == 0 ? kStart : kFinish], 0, moment, shortest);
      }
    };
    for (int e = 0; e < edges; ++e) {
      const double pull = kRounding * stretching_;
      for (const int i : {e, e + 1}) allow_vertex(i, pull, length(e));
    }
    for (int i = 1; i < edges; ++i) {
      const double before = length(i - 1), after = length(i);
      const double shortest = std::min(before, after);
      const double moment = kRounding * stiffest_bending_ / ((before + after) / 2);
      for (const int v : {i - 1, i}) allow_vertex(v, moment / before, shortest);
      for (const int v : {i, i + 1}) allow_vertex(v, moment / after, shortest);
      for (const int e : {i - 1, i}) allow_angle(e, moment, shortest);
    }
  }
  force_rounding_ = size_of(rounding_).force;
  force_rounding_per_distance_ = size_of(rounding_per_distance_).force;
}

double UnknownScales::beyond(const LinkageState& state) const {
  double farthest = farthest_;
  for (const auto& joint : state.joints())
    farthest = std::max(farthest, joint.position.cwiseAbs().maxCoeff());
  return farthest - farthest_;
}

double UnknownScales::imbalance(const Eigen::Ref<const Eigen::VectorXd>& gradient,
                                const GradientSize& present, double tolerance,
                                double beyond) const {
  double largest = 0;
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    const double scale = kinds_[i] == UnknownKind::kLength ? present.force : present.moment;
    const double rounding = rounding_[i] + beyond * rounding_per_distance_[i];
    const double size = std::abs(gradient[i]) / (scale + rounding / tolerance);
    // Not a number must not pass for balance.
    if (!(size <= largest)) largest = size;
  }
  return largest;
}

int UnknownScales::most_unbalanced(const Eigen::Ref<const Eigen::VectorXd>& gradient,
                                   const GradientSize& present, double tolerance,
                                   double beyond) const {
  int worst = -1;
  double largest = 0;
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    const double scale = kinds_[i] == UnknownKind::kLength ? present.force : present.moment;
    const double rounding = rounding_[i] + beyond * rounding_per_distance_[i];
    const double size = std::abs(gradient[i]) / (scale + rounding / tolerance);
    if (size <= largest) continue;
    largest = size;
    worst = static_cast<int>(i);
  }
  return worst;
}

GradientSize UnknownScales::size_of(const Eigen::Ref<const Eigen::VectorXd>& gradient) const {
  GradientSize result;
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    double& largest = kinds_[i] == UnknownKind::kLength ? result.force : result.moment;
    const double size = std::abs(gradient[i]);
    // Not a number must not pass for balance.
    if (!(size <= largest)) largest = size;
  }
  return result;
}

GradientSize UnknownScales::present(const RodEnergies& energies) const {
  const double pull = std::sqrt(2 * energies.stretching * stretching_ / total_length_);
  const double moment =
      std::sqrt(2 * (energies.bending + energies.twisting) * stiffest_bending_ / total_length_);
  GradientSize result;
  result.force = std::max(pull, moment / segment_);
  result.moment = std::max(moment, pull * edge_);
  return result;
}

double UnknownScales::largest_turn(const LinkageModel& model, const LinkageState& state,
                                   const Eigen::Ref<const Eigen::VectorXd>& step) const {
  const ReducedVariables& variables = model.variables();
  double largest = 0;
  for (int j = 0; j < variables.joints(); ++j) {
    const int begin = variables.joint_begin(j);
    largest = std::max({largest, step.segment<3>(begin + kJointRotation).squaredNorm(),
                        square(step[begin + kJointAngle])});
  }
  constexpr std::ptrdiff_t kSlot = LinkageState::kFields * kChainLanes;  // numbers of a slot
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    int first = 0;
    int last = edges;  // vertices that no joint moves
    while (first < last && variables.position(s, first) < 0) ++first;
    while (last > first && variables.position(s, last) < 0) --last;
    for (int e = 0; e < edges; ++e) {
      const int angle = variables.angle(s, e);
      if (angle >= 0) largest = std::max(largest, 0.25 * square(step[angle]));
    }
    if (variables.position(s, first) < 0) continue;
    const ChainBatches::Place place = model.chains()->place(s);
    const double* const slots = state.slots(model, place.batch) + place.lane;
    const double* const changes = step.data() + variables.position(s, first);
    for (int i = first; i < last; ++i) {
      const double* const from = slots + i * kSlot;
      const double* const change = changes + (i - first) * 4;
      Eigen::Vector3d along, turning;
      for (int axis = 0; axis < 3; ++axis) {
        along[axis] = from[kSlot + axis * kChainLanes] - from[axis * kChainLanes];
        turning[axis] = change[4 + axis] - change[axis];
      }
      largest = std::max(largest, along.cross(turning).squaredNorm() / square(along.squaredNorm()));
    }
  }
  return std::sqrt(largest);
}

}  // namespace limber::rods::detail
