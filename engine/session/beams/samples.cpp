#include "engine/session/beams/samples.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "engine/base/error.h"

namespace limber::session {
namespace {

/// Pulled pipes of glass fibre, as gridshells are made of.
const beams::BeamMaterial kGlassFibre{25e9, 0.3, 1850, 400e6};

beams::BeamSupport support(int node, std::array<bool, 6> fixed) {
  beams::BeamSupport support;
  support.node = node;
  support.fixed = fixed;
  return support;
}

beams::PrescribedMotion motion(int node, int axis, double by) {
  beams::PrescribedMotion motion;
  motion.node = node;
  motion.translates[static_cast<std::size_t>(axis)] = true;
  motion.translation[axis] = by;
  return motion;
}

void add_element(int start, int finish, beams::BeamModel& model) {
  beams::BeamElement element;
  element.start = start;
  element.finish = finish;
  model.elements.push_back(element);
}

BeamSample tubes(double outer_radius, double inner_radius) {
  BeamSample sample;
  sample.outer_radius = outer_radius;
  sample.inner_radius = inner_radius;
  sample.material = kGlassFibre;
  sample.model.sections.push_back(
      beams::make_section(beams::tube(outer_radius, inner_radius), sample.material));
  sample.model.gravity = {0, 0, -9.81};
  return sample;
}

/// 4 m of rod, a little out of line so that it knows where up is; hinges at both ends.
BeamSample arch() {
  constexpr int kElements = 40;
  constexpr double kLength = 4, kRise = 0.05;
  BeamSample sample = tubes(0.01, 0);
  beams::BeamModel& model = sample.model;
  for (int i = 0; i <= kElements; ++i) {
    beams::BeamNode node;
    const double share = static_cast<double>(i) / kElements;
    node.position = {kLength * share, 0, kRise * std::sin(std::numbers::pi * share)};
    model.nodes.push_back(node);
    if (i > 0) add_element(i - 1, i, model);
  }
  model.supports = {support(0, {true, true, true, true, false, true}),
                    support(kElements, {false, true, true, true, false, true})};
  model.motions = {motion(kElements, 0, -0.8)};
  return sample;
}

/// Seven rods in each direction, a metre apart, each 8 m long; two elements from crossing to
/// crossing. Ends are hinged and move inwards, by most in the middle of a side, as a dome of
/// cosines wants it.
class Gridshell {
 public:
  Gridshell() : sample_(tubes(0.016, 0.013)) {
    for (int line = -kHalf + 1; line < kHalf; ++line) {
      for (const int along : {0, 1}) add_rod(along, line);
    }
    for (int i = 0; i < static_cast<int>(sample_.model.nodes.size()); ++i) {
      beams::NodalLoad lift;
      lift.node = i;
      lift.force = {0, 0, 20};
      sample_.model.temporary_loads.push_back(lift);
    }
  }
  [[nodiscard]] BeamSample take() { return std::move(sample_); }

 private:
  static constexpr int kHalf = 4;           // cells from the middle to the rim
  static constexpr double kDeepest = 0.24;  // by which an end moves in [m]

  /// A node, the same for rods that cross there. Places are counted in half cells.
  int node_at(int x, int y) {
    const auto [found, fresh] =
        nodes_.try_emplace({x, y}, static_cast<int>(sample_.model.nodes.size()));
    if (fresh) {
      beams::BeamNode node;
      node.position = {0.5 * x, 0.5 * y, 0};
      sample_.model.nodes.push_back(node);
    }
    return found->second;
  }

  /// @param along  0: x, 1: y. @param line  cells from the middle
  void add_rod(int along, int line) {
    const auto at = [&](int step) {
      return along == 0 ? node_at(step, 2 * line) : node_at(2 * line, step);
    };
    beams::BeamModel& model = sample_.model;
    for (int step = -2 * kHalf; step < 2 * kHalf; ++step)
      add_element(at(step), at(step + 1), model);
    const double share = std::cos(0.5 * std::numbers::pi * line / kHalf);
    for (const int side : {-1, 1}) {
      const int end = at(2 * kHalf * side);
      std::array<bool, 6> fixed{true, true, true, false, false, false};
      fixed[static_cast<std::size_t>(along)] = false;  // that is where it moves
      fixed[static_cast<std::size_t>(3 + along)] = true;
      model.supports.push_back(support(end, fixed));
      model.motions.push_back(motion(end, along, -side * kDeepest * share * share));
    }
  }

  BeamSample sample_;
  std::map<std::pair<int, int>, int> nodes_;
};

}  // namespace

const std::vector<std::string>& beam_sample_names() {
  static const std::vector<std::string> names{"arch", "gridshell"};
  return names;
}

BeamSample make_beam_sample(const std::string& name) {
  if (name == "arch") return arch();
  if (name == "gridshell") return Gridshell().take();
  throw Error(ErrorCode::kNotFound, "name", fmt::format("there is no sample '{}'", name));
}

}  // namespace limber::session
