#include "tests/support/random_beams.h"

#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/random.h"
#include "tests/support/beam_problems.h"
#include "tests/support/dense.h"

namespace limber::testing {

using namespace beams;
using Eigen::Vector3d;

namespace {

double between(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

Vector3d direction(Random& random) {
  return Vector3d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5)
      .normalized();
}

int add_node(BeamModel& model, const Vector3d& position) {
  model.nodes.push_back({position, Vector3d(0.31, 0.17, 0.93)});
  return static_cast<int>(model.nodes.size()) - 1;
}

/// Straight, of a few elements. @returns its last node
int add_bar(BeamModel& model, Random& random, int from, const Vector3d& to, int section) {
  const int elements = 2 + static_cast<int>(3 * random.uniform());
  const Vector3d start = model.nodes[static_cast<std::size_t>(from)].position;
  for (int i = 1; i <= elements; ++i) {
    BeamElement e;
    e.start = from;
    e.finish = add_node(model, start + (to - start) * i / elements);
    e.section = section;
    from = e.finish;
    model.elements.push_back(e);
  }
  return from;
}

}  // namespace

BeamModel random_beams(std::uint64_t seed, Bending bending_of_sections) {
  Random random(seed);
  BeamModel model;
  const int parts = 1 + static_cast<int>(3 * random.uniform());
  int last = -1;
  for (int part = 0; part < parts; ++part) {
    const double bending = std::pow(10, between(random, -4, 0));
    const double given = between(random, 1.2, 5);
    const double ratio = bending_of_sections == Bending::kAlike ? 1 : given;
    const int section = static_cast<int>(model.sections.size());
    model.sections.push_back(
        {bending * 1e5, bending * between(random, 0.3, 1.5), bending, bending * ratio});
    const bool hangs_on = last >= 0 && random.uniform() < 0.4;
    int from = hangs_on ? last : add_node(model, Vector3d(3.0 * part, 0, 0));
    if (!hangs_on) model.supports.push_back(clamped(from));
    const int bars = 1 + static_cast<int>(2 * random.uniform());
    Vector3d along = direction(random);
    double length = 1;
    for (int bar = 0; bar < bars; ++bar) {
      along = direction(random);
      length = between(random, 0.5, 1.5);
      const Vector3d start = model.nodes[static_cast<std::size_t>(from)].position;
      from = add_bar(model, random, from, start + length * along, section);
    }
    if (random.uniform() < 0.3) {
      BeamSupport support{from, {true, true, false, false, false, false}};
      support.axes = reference::rotation_between(Vector3d::UnitZ(), along).toRotationMatrix();
      model.supports.push_back(support);
    }
    // Along the last bar it stays straight, in any direction.
    const double size = between(random, -2, 12) * bending / (length * length);
    const bool is_along = random.uniform() < 0.6;
    model.loads.push_back({from, -size * (is_along ? along : direction(random))});
    last = from;
  }
  return model;
}

}  // namespace limber::testing
