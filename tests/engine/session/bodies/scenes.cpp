#include "tests/engine/session/bodies/scenes.h"

#include <algorithm>
#include <limits>

namespace limber::session::test {

int below(Random& random, int bound) {
  return static_cast<int>(random.index(static_cast<std::uint64_t>(bound)));
}

scene::Scene two_tets() {
  scene::Scene scene;
  scene.name = "two tets";
  scene.mesh.nodes.resize(3, 6);
  scene.mesh.nodes.transpose() << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 5, 5, 5;
  scene.mesh.tets.resize(4, 2);
  scene.mesh.tets.transpose() << 0, 1, 2, 3, 0, 2, 1, 4;
  scene.fixed_nodes = {0, 1, 2};
  scene.frame_count = 10;
  return scene;
}

scene::Constraint held(int frame, int node, const Eigen::Vector3d& target) {
  scene::Constraint constraint;
  constraint.frame = frame;
  constraint.nodes = {node};
  constraint.target = target;
  return constraint;
}

scene::Keyframe keyed(int frame, double value) {
  scene::Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Constant(18, value));
  return keyframe;
}

bool same(const scene::Constraint& a, const scene::Constraint& b) {
  const auto same_point = [](const scene::SurfacePoint& p, const scene::SurfacePoint& q) {
    return p.triangle == q.triangle && p.weights == q.weights && p.surface == q.surface;
  };
  return a.id == b.id && a.frame == b.frame && a.nodes == b.nodes && a.axes == b.axes &&
         a.kind == b.kind && a.target == b.target && a.weight == b.weight &&
         a.point.has_value() == b.point.has_value() &&
         (!a.point || same_point(*a.point, *b.point)) && a.surface_vertex == b.surface_vertex &&
         std::equal(a.path.begin(), a.path.end(), b.path.begin(), b.path.end(),
                    [](const scene::PathKey& p, const scene::PathKey& q) {
                      return p.frame == q.frame && p.target == q.target;
                    }) &&
         a.ease_in == b.ease_in && a.ease_out == b.ease_out && a.reach == b.reach;
}

BodyEdit random_edit(Random& random) {
  const auto constraint = [&] {
    scene::Constraint c = held(below(random, 10), below(random, 5));
    if (below(random, 3) == 0) c.nodes = {0, 1 + below(random, 4)};
    if (below(random, 4) == 0) {
      c.nodes.clear();
      c.point = scene::SurfacePoint{below(random, 6), {0.25, 0.75, 0}};
    }
    c.axes = 1 + static_cast<unsigned>(below(random, 7));
    c.kind = static_cast<scene::TargetKind>(below(random, 3));
    c.target = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (below(random, 4) == 0) c.weight = std::numeric_limits<double>::infinity();
    if (c.kind != scene::TargetKind::kVelocity && c.frame < 9 && below(random, 4) == 0) {
      c.path = {{c.frame + 1 + below(random, 9 - c.frame), {0, random.uniform(-1, 1), 0}}};
      c.ease_in = random.uniform(0, 1);
    }
    return c;
  };
  const auto id = [&] { return static_cast<std::uint64_t>(1 + below(random, 12)); };
  const auto end = [&] { return static_cast<scene::End>(below(random, 4)); };
  switch (below(random, 18)) {
    case 0:
    case 1:
    case 2:
      return AddConstraint{constraint()};
    case 3: {
      scene::Constraint c = constraint();
      c.id = id();
      return AddConstraint{c};
    }
    case 4:
    case 5:
      return MoveConstraint{id(), {random.uniform(-1, 1), 0, 1}};
    case 6: {
      scene::Constraint c = constraint();
      c.id = id();
      return ReplaceConstraint{c};
    }
    case 7:
      return RemoveConstraint{id()};
    case 8:
      return SetEnds{end(), end()};
    case 9:
      return SetDynamics{{30, random.uniform(2, 50), random.uniform(0, 0.5)}};
    case 10:
    case 11:
    case 12:
      return Undo{};
    case 13:
    case 14:
      return AddKeyframe{keyed(below(random, 10), random.uniform(-1, 1))};
    case 15:
      return MoveKeyframe{static_cast<std::uint64_t>(1 + below(random, 4)), below(random, 10), {}};
    case 16:
      return RemoveKeyframe{static_cast<std::uint64_t>(1 + below(random, 4))};
    default:
      return Redo{};
  }
}

int bar_node(int cells, int i, int j, int k) { return i + (cells + 1) * (j + 2 * k); }

scene::Scene bar(int cells, int frames, double side) {
  scene::Scene scene;
  scene.name = "bar";
  scene.mesh.nodes.resize(3, (cells + 1) * 2 * 3);
  for (int k = 0; k <= 2; ++k) {
    for (int j = 0; j <= 1; ++j) {
      for (int i = 0; i <= cells; ++i)
        scene.mesh.nodes.col(bar_node(cells, i, j, k)) = side * Eigen::Vector3d(i, j, k);
    }
  }
  // Kuhn's six tets of a cube: one per order of the axes, all around the same diagonal.
  static constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                        {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  scene.mesh.tets.resize(4, cells * 2 * 6);
  int tet = 0;
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < cells; ++i) {
      for (const auto& order : kOrders) {
        int at[3] = {i, 0, k};
        scene.mesh.tets(0, tet) = bar_node(cells, at[0], at[1], at[2]);
        for (int c = 0; c < 3; ++c) {
          ++at[order[c]];
          scene.mesh.tets(c + 1, tet) = bar_node(cells, at[0], at[1], at[2]);
        }
        ++tet;
      }
    }
  }
  for (int k = 0; k <= 2; ++k) {
    for (int j = 0; j <= 1; ++j) scene.fixed_nodes.push_back(bar_node(cells, 0, j, k));
  }
  scene.frame_count = frames;
  scene.dynamics.period_frames = 20;
  scene.model.mode_count = 10;
  scene.model.basis_size = 20;
  scene.model.cubature_size = 10;
  return scene;
}

}  // namespace limber::session::test
