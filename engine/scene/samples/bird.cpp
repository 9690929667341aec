#include <cmath>

#include "engine/scene/samples/sample_parts.h"
#include "engine/scene/samples/shapes.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"

namespace limber::scene::samples {
namespace {

/// A bird in glide: head towards +x, up is +y, wings along z; symmetric to the plane z = 0.
ImplicitSolid bird_solid() {
  const Tube body = smooth_tube(
      {{-0.2, 0.01, 0}, {-0.08, 0, 0}, {0.06, 0, 0}, {0.17, 0.045, 0}, {0.245, 0.085, 0}},
      {0.034, 0.068, 0.082, 0.062, 0.056}, 4);
  Blade inner;  // arm of the wing at z > 0
  inner.root = Vector3d(0.03, 0.02, 0.03);
  inner.along = Vector3d(0.05, 0.3, 1).normalized();
  inner.up = (Vector3d::UnitY() - Vector3d::UnitY().dot(inner.along) * inner.along).normalized();
  inner.length = 0.2;
  inner.root_radius = 0.1;
  inner.tip_radius = 0.085;
  inner.half_thickness = 0.022;
  Blade outer;  // hand of the wing
  outer.root = inner.root + inner.length * inner.along;
  outer.along = Vector3d(-0.35, 0.02, 1).normalized();
  outer.up = (Vector3d::UnitY() - Vector3d::UnitY().dot(outer.along) * outer.along).normalized();
  outer.length = 0.3;
  outer.root_radius = 0.085;
  outer.tip_radius = 0.032;
  outer.half_thickness = 0.021;
  outer.curl = -0.35;
  Blade tail;
  tail.root = Vector3d(-0.17, 0.012, 0);
  tail.along = Vector3d(-1, 0.12, 0).normalized();
  tail.up = Vector3d(0.12, 1, 0).normalized();
  tail.length = 0.2;
  tail.root_radius = 0.035;
  tail.tip_radius = 0.085;
  tail.half_thickness = 0.021;
  ImplicitSolid solid;
  solid.distance = [=](const Vector3d& point) {
    const Vector3d x(point[0], point[1], std::abs(point[2]));
    const double beak = round_cone(x, {0.28, 0.082, 0}, 0.032, {0.37, 0.06, 0}, 0.014);
    const double trunk = blend(blend(body.distance(x), beak, 0.02), tail.distance(x), 0.04);
    const double wing = blend(inner.distance(x), outer.distance(x), 0.03);
    return blend(trunk, wing, 0.04);
  };
  solid.bounds = Eigen::AlignedBox3d(Vector3d(-0.5, -0.12, -0.66), Vector3d(0.42, 0.24, 0.66));
  solid.lipschitz = 1.5;
  return solid;
}

}  // namespace

Scene make_bird() {
  Scene scene;
  scene.name = "bird";
  TetrahedralizeOptions options;
  options.cell_size = 0.04167;  // found once by search; fixed, so that samples are quick to make
  scene.mesh = mesh_of(bird_solid(), options);
  scene.material = {5e5, 0.45, 400};
  fix_where(scene, [](const Vector3d& x) {
    return (x - Vector3d(0.03, -0.01, 0)).cwiseQuotient(Vector3d(0.075, 0.05, 0.05)).norm() < 1;
  });
  scene.frame_count = 150;
  scene.dynamics.period_frames = 24;
  scene.model.mode_count = 30;
  // One stroke of both wings: up, down, up again.
  const int left = node_near(scene.mesh, {-0.08, 0.1, 0.54});
  const int right = node_near(scene.mesh, {-0.08, 0.1, -0.54});
  const struct {
    int frame;
    double lift, inward;
  } strokes[] = {{20, 0.2, 0.1}, {40, -0.24, 0.09}, {60, 0.17, 0.07}};
  for (const auto& stroke : strokes) {
    add_target(scene, stroke.frame, left, {0, stroke.lift, -stroke.inward});
    add_target(scene, stroke.frame, right, {0, stroke.lift, stroke.inward});
  }
  return scene;
}

}  // namespace limber::scene::samples
