#include <cmath>

#include "engine/scene/samples/sample_parts.h"
#include "engine/scene/samples/shapes.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"

namespace limber::scene::samples {
namespace {

/// A long-necked dinosaur on four legs: head towards +x, up is +y, ground at y = 0; symmetric to
/// the plane z = 0.
ImplicitSolid dino_solid() {
  const Tube back = smooth_tube({{-0.78, 0.34, 0},
                                 {-0.55, 0.3, 0},
                                 {-0.34, 0.36, 0},
                                 {-0.16, 0.42, 0},
                                 {0.04, 0.43, 0},
                                 {0.2, 0.46, 0},
                                 {0.33, 0.6, 0},
                                 {0.41, 0.77, 0},
                                 {0.47, 0.88, 0}},
                                {0.026, 0.045, 0.082, 0.15, 0.165, 0.115, 0.068, 0.052, 0.05}, 4);
  const Tube front_leg = smooth_tube({{0.12, 0.36, 0.09}, {0.13, 0.19, 0.115}, {0.12, 0.0, 0.12}},
                                     {0.08, 0.055, 0.062}, 4);
  const Tube hind_leg = smooth_tube({{-0.16, 0.36, 0.09}, {-0.13, 0.2, 0.115}, {-0.17, 0.0, 0.12}},
                                    {0.095, 0.062, 0.066}, 4);
  ImplicitSolid solid;
  solid.distance = [=](const Vector3d& point) {
    const Vector3d x(point[0], point[1], std::abs(point[2]));
    const double head = round_cone(x, {0.485, 0.9, 0}, 0.062, {0.6, 0.865, 0}, 0.042);
    const double legs = std::min(front_leg.distance(x), hind_leg.distance(x));
    const double all = blend(blend(back.distance(x), head, 0.04), legs, 0.05);
    return std::max(all, -x[1]);  // flat soles
  };
  solid.bounds = Eigen::AlignedBox3d(Vector3d(-0.83, -0.01, -0.24), Vector3d(0.68, 1.0, 0.24));
  solid.lipschitz = 1.2;
  return solid;
}

}  // namespace

Scene make_dino() {
  Scene scene;
  scene.name = "dino";
  TetrahedralizeOptions options;
  options.cell_size = 0.05673;  // found once by search; fixed, so that samples are quick to make
  scene.mesh = mesh_of(dino_solid(), options);
  scene.material = {1e6, 0.45, 1000};
  fix_where(scene, [](const Vector3d& x) { return x[1] < 0.035; });
  scene.frame_count = 620;
  scene.dynamics.period_frames = 50;
  scene.model.mode_count = 30;
  const int head = node_near(scene.mesh, {0.64, 0.87, 0});
  const int tail = node_near(scene.mesh, {-0.8, 0.34, 0});
  // The head looks around, the tail swings against it.
  add_target(scene, 80, head, {-0.1, -0.05, 0.3});
  add_target(scene, 80, tail, {0.05, 0.05, 0.22});
  add_target(scene, 200, head, {0.08, -0.28, 0});
  add_target(scene, 320, head, {-0.1, -0.05, -0.3});
  add_target(scene, 320, tail, {0.05, 0.05, -0.22});
  add_target(scene, 460, head, {-0.22, 0.06, 0});
  return scene;
}

}  // namespace limber::scene::samples
