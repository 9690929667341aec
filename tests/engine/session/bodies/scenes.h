#pragma once

#include <limits>

#include "engine/base/random.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/edit.h"

namespace limber::session::test {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Uniform in 0 .. bound - 1.
int below(Random& random, int bound);

/// Two tets over a triangle (nodes 0 to 4), node 5 unused; 10 frames. Enough for a document.
scene::Scene two_tets();

/// Node held at a displacement in a frame, with id 0.
scene::Constraint held(int frame, int node, const Eigen::Vector3d& target = {0, 0, 0});

/// A pose of two_tets() that is `value` everywhere, in a frame, with id 0.
scene::Keyframe keyed(int frame, double value = 0);

bool same(const scene::Constraint& a, const scene::Constraint& b);

/// Any kind of edit of two_tets(), sometimes of an unknown constraint.
BodyEdit random_edit(Random& random);

/// A bar along x of `cells` cubes of `side` (six tets each, diagonals not mirrored), held at x = 0,
/// clamped ends. Cross-section 1 x 2 x `cells`: no two bending modes alike.
scene::Scene bar(int cells, int frames, double side = 0.1);

/// Node of bar() at the grid point (i, j, k).
int bar_node(int cells, int i, int j, int k);

}  // namespace limber::session::test
