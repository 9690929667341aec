#include "tests/support/beam_grid.h"

namespace limber::testing {

beams::BeamModel beam_grid(const BeamGrid& grid) {
  beams::BeamModel model;
  model.sections.push_back(
      beams::make_section(beams::circle(grid.radius), {25e9, 0.3, 1850, 400e6}));
  model.gravity = {0, 0, -9.81};
  const int n = grid.nodes;
  const double cell = grid.side / (n - 1);
  const auto add_element = [&model](int start, int finish) {
    beams::BeamElement element;
    element.start = start;
    element.finish = finish;
    model.elements.push_back(element);
  };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const int node = y * n + x;
      model.nodes.push_back({{cell * x, cell * y, 0}, {0, 0, 1}});
      if (x > 0) add_element(node - 1, node);
      if (y > 0) add_element(node - n, node);
      const bool x_rim = x == 0 || x == n - 1, y_rim = y == 0 || y == n - 1;
      const bool is_held = grid.held == BeamGrid::Held::kCorners ? x_rim && y_rim : x_rim || y_rim;
      if (!is_held) continue;
      const bool turns = grid.held != BeamGrid::Held::kRimClamped;
      beams::BeamSupport support;
      support.node = node;
      support.fixed = {true, true, true, !turns, !turns, !turns};
      model.supports.push_back(support);
    }
  }
  return model;
}

}  // namespace limber::testing
