// Equilibria of linkages where solvers break.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/edge_counts.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::curved_model;
using testing::gapped_model;
using testing::grid_model;
using testing::joint_distance;
using testing::kStrip;
using testing::linkage_file;

double widest_angle(const LinkageState& state) {
  double widest = 0;
  for (const JointState<double>& joint : state.joints())
    widest = std::max(widest, std::abs(joint.opening_angle));
  return widest;
}

TEST(HardEquilibria, FullyClosedByItsMeanAngle) {
  // Equal cells close at every joint for nothing.
  const LinkageModel model = grid_model(4, 4, 0.6);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = 0;
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_NEAR(state.mean_opening_angle(), 0, 1e-12);
  EXPECT_LT(widest_angle(state), 1e-5);  // which costs the angle squared
  EXPECT_LT(report.energies.total(), 1e-15);
}

TEST(HardEquilibria, FullyClosedAgainstItsShape) {
  // Of unequal cells some joints open beyond 0 for others where the mean alone is held.
  const LinkageModel model = curved_model();
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = 0;
  const EquilibriumReport mean = equilibrium.solve(state, conditions);
  ASSERT_TRUE(mean.converged()) << mean.message;
  EXPECT_NEAR(state.mean_opening_angle(), 0, 1e-12);
  EXPECT_GT(widest_angle(state), 0.1);
  EXPECT_LT(widest_angle(state), 0.3);
  conditions.mean_opening_angle.reset();
  for (int j = 0; j < 16; ++j) conditions.angles.push_back({j, 0});
  const EquilibriumReport every = equilibrium.solve(state, conditions);
  ASSERT_TRUE(every.converged()) << every.message;
  EXPECT_LT(widest_angle(state), 1e-12);
  EXPECT_GT(every.energies.total(), mean.energies.total());
  EXPECT_LT(every.energies.total(), 1.1 * mean.energies.total());
}

TEST(HardEquilibria, EveryAngleClosedOneByOne) {
  const LinkageModel model = grid_model(3, 3, 0.5);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  for (int j = 0; j < 9; ++j) conditions.angles.push_back({j, 0});
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT(widest_angle(state), 1e-12);
}

TEST(HardEquilibria, Flat) {
  // Nothing drives it out of its plane, where it stays as long as that is stable.
  const LinkageModel model = grid_model(5, 5, 1.0);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = 1.2;
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  ASSERT_TRUE(report.converged()) << report.message;
  EXPECT_EQ(report.negative_eigenvalues, 0);
  for (const JointState<double>& joint : state.joints()) EXPECT_NEAR(joint.position.z(), 0, 1e-6);
  // Rods of equal cells turn without bending.
  EXPECT_LT(report.energies.total(), 1e-8);
}

TEST(HardEquilibria, MechanismOfFourBars) {
  const LinkageModel model = grid_model(2, 2, 1.0);
  LinkageEquilibrium equilibrium(model);
  for (const double angle : {1.3, 0.2, 2.5}) {
    LinkageState state(model);
    Conditions conditions;
    const EquilibriumReport free = equilibrium.solve(state, conditions);
    EXPECT_TRUE(free.converged()) << free.message;
    conditions.mean_opening_angle = angle;
    const EquilibriumReport report = equilibrium.solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    EXPECT_LT(report.energies.total(), 1e-8);
    EXPECT_NEAR(state.mean_opening_angle(), angle, 1e-12);
  }
}

TEST(HardEquilibria, MechanismFish) {
  if (!std::filesystem::exists(linkage_file("fish_linkage"))) GTEST_SKIP() << "no data";
  // In metres and newtons: E = 2 GPa, 4 x 2 mm.
  const LinkageModel model(
      build_linkage_graph(scene::read_line_mesh_file(linkage_file("fish_linkage"))), 10,
      {16000, 0.0213, 0.00533, 0.0113});
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  EXPECT_TRUE(equilibrium.solve(state, conditions).converged());
  const double start = state.mean_opening_angle();
  for (const double angle : {start + 0.2, start - 0.1, start}) {
    conditions.mean_opening_angle = angle;
    const EquilibriumReport report = equilibrium.solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    EXPECT_NEAR(state.mean_opening_angle(), angle, 1e-12);
  }
}

TEST(HardEquilibria, MillimetresAndMetresGiveTheSameShape) {
  // N, mm against N, m: lengths / 1000, E A as it is, E I / 10^6.
  const LinkageModel small = curved_model();
  const LinkageModel large = curved_model(1e-3, {kStrip.stretching, kStrip.bending_1 * 1e-6,
                                                 kStrip.bending_2 * 1e-6, kStrip.torsion * 1e-6});
  LinkageState in_mm(small);
  LinkageState in_m(large);
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.mean_opening_angle = 1.0;
  conditions.loads = {{15, Eigen::Vector3d(0, 0.1, 0.3), Eigen::Vector3d::Zero(), 0}};
  LinkageEquilibrium first(small);
  LinkageEquilibrium second(large);
  const EquilibriumReport a = first.solve(in_mm, conditions);
  const EquilibriumReport b = second.solve(in_m, conditions);
  ASSERT_TRUE(a.converged()) << a.message;
  ASSERT_TRUE(b.converged()) << b.message;
  EXPECT_LT(joint_distance(in_mm, in_m, 1000), 1e-3);
  EXPECT_NEAR(b.energies.total(), 1e-3 * a.energies.total(), 1e-9 * a.energies.total());
}

TEST(HardEquilibria, StifferByTenOrdersIsTheSameShape) {
  std::vector<LinkageState> shapes;
  for (const double factor : {1e-5, 1.0, 1e5}) {
    const LinkageModel model =
        curved_model(1, {kStrip.stretching * factor, kStrip.bending_1 * factor,
                         kStrip.bending_2 * factor, kStrip.torsion * factor});
    LinkageState state(model);
    LinkageEquilibrium equilibrium(model);
    Conditions conditions;
    conditions.pins = {{5}};
    conditions.mean_opening_angle = 1.0;
    const EquilibriumReport report = equilibrium.solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    shapes.push_back(state);
  }
  EXPECT_LT(joint_distance(shapes[0], shapes[1]), 1e-3);
  EXPECT_LT(joint_distance(shapes[2], shapes[1]), 1e-3);
}

/// A vertex of segment 0 moved back over the one before it, its edge then turned against that by
/// all but an angle.
LinkageState folded_back(const LinkageModel& model, double missing) {
  const LinkageState drawn(model);
  const int before = 2, folded = 3;
  const Eigen::Vector3d along = drawn.vertex(model, 0, folded) - drawn.vertex(model, 0, before);
  const Eigen::Vector3d beside = Eigen::Vector3d::UnitZ() * along.norm();
  Eigen::VectorXd increment = Eigen::VectorXd::Zero(model.variables().size());
  increment.segment<3>(model.variables().position(0, folded)) =
      -along - std::cos(missing) * along + std::sin(missing) * beside;
  return drawn.moved(model, increment);
}

TEST(HardEquilibria, EdgesFoldingToAntiparallelUnfold) {
  const LinkageModel model = grid_model(3, 3, 1.0);
  LinkageEquilibrium equilibrium(model);
  for (const double missing : {0.1, 1e-2, 1e-4, 1e-6}) {
    LinkageState state = folded_back(model, missing);
    const EquilibriumReport report = equilibrium.solve(state, {});
    EXPECT_TRUE(report.converged()) << missing << ": " << report.message;
    EXPECT_LT(report.energies.total(), 1e-8) << missing;
    EXPECT_LT(std::abs(state.vertex(model, 0, 3).z() - state.vertex(model, 0, 2).z()), 1e-4);
  }
}

TEST(HardEquilibria, AnEdgeFoldedBackEntirelyIsReported) {
  const LinkageModel model = grid_model(3, 3, 1.0);
  LinkageEquilibrium equilibrium(model);
  LinkageState state = folded_back(model, 0);
  const EquilibriumReport report = equilibrium.solve(state, {});
  EXPECT_EQ(report.status, EquilibriumStatus::kStalled);
  EXPECT_NE(report.message.find("folded back"), std::string::npos) << report.message;
}

TEST(HardEquilibria, ShortSegmentsDoNotSwallowLoads) {
  // A cantilever of 1 m between crossing rods, of steel 20 x 10 mm, in N and mm: F L^3 / 3 EI = 2
  // mm.
  const auto tip = [](double cross, int edges, EquilibriumReport& report) {
    LineMesh mesh;
    mesh.vertices.resize(3, 8);
    mesh.vertices << -200, 0, 1000, 1200, 0, 0, 1000, 1000,  //
        0, 0, 0, 0, 200, -200, cross, -cross,                //
        0, 0, 0, 0, 0, 0, 0, 0;
    mesh.edges.resize(2, 7);
    mesh.edges << 0, 1, 2, 4, 1, 6, 2,  //
        1, 2, 3, 1, 5, 2, 7;
    const LinkageModel model(build_linkage_graph(mesh), edges, {4e7, 1.333e9, 3.333e8, 3.5e8});
    LinkageState state(model);
    LinkageEquilibrium equilibrium(model);
    Conditions conditions;
    conditions.pins = {{0, Hold::kMotionAndAngle}};
    conditions.loads = {{1, Eigen::Vector3d(0, 0, -2), Eigen::Vector3d::Zero(), 0}};
    report = equilibrium.solve(state, conditions);
    return state.joints()[1].position.z();
  };
  EquilibriumReport report;
  for (const double cross : {200.0, 20.0, 5.0}) {
    EXPECT_NEAR(tip(cross, 10, report), -2, 0.03) << cross;
    EXPECT_TRUE(report.converged()) << cross << ": " << report.message;
  }
  // So short that the stiffness of its edges leaves 2 N no digits: then that is reported.
  const double lost = tip(1, 40, report);
  EXPECT_TRUE(!report.converged() || std::abs(lost + 2) < 0.1) << lost << ": " << report.message;
}

/// Held at one corner: where the other one, joint 11, goes under all that acts one after the other.
Eigen::Vector3d corner_moved(const LinkageModel& model,
                             const std::vector<std::function<void(Conditions&)>>& acting) {
  LinkageState state(model);
  const Eigen::Vector3d drawn = state.joints()[11].position;
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}};
  for (const auto& act : acting) {
    act(conditions);
    const EquilibriumReport report = equilibrium.solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    EXPECT_LE(report.iterations, 5);
  }
  return state.joints()[11].position - drawn;
}

std::function<void(Conditions&)> force_at(int joint, const Eigen::Vector3d& force) {
  return [=](Conditions& conditions) {
    conditions.loads.push_back({joint, force, Eigen::Vector3d::Zero(), 0});
  };
}

/// Rounding of places makes forces in them as large as these loads, which move nothing.
TEST(HardEquilibria, SegmentsOfLessThanAThousandthHideNoSmallLoads) {
  const Eigen::Vector3d down(0, 0, -1);
  const double softness = -corner_moved(gapped_model(1, 3), {force_at(11, 15 * down)}).z() / 15;
  for (const double gap : {1.0, 0.1, 0.03, 0.01, 0.003}) {
    for (const int edges : {3, 10}) {
      const LinkageModel model = gapped_model(gap, edges);
      for (const double load : {0.005, 0.5, 15.0}) {
        SCOPED_TRACE(::testing::Message() << gap << ", " << load << " N, " << edges);
        // A fiftieth softer where the gap is 1 and not 0.
        EXPECT_NEAR(-corner_moved(model, {force_at(11, load * down)}).z() / load / softness,
                    1 - 0.018 * (1 - gap), 0.015);
      }
    }
  }
}

TEST(HardEquilibria, SegmentsOfLessThanAThousandthHideNoSpringsMomentsAndTorques) {
  const auto spring = [](double stiffness) {  // pulled to 5 above
    return [=](Conditions& conditions) {
      conditions.springs = {{JointPoint{2}, Eigen::Vector3d(40, 0, 5), stiffness}};
    };
  };
  const auto turned = [](double moment, double torque) {
    return [=](Conditions& conditions) {
      conditions.loads = {{2, Eigen::Vector3d::Zero(), moment * Eigen::Vector3d::UnitX(), torque}};
    };
  };
  const LinkageModel wide = gapped_model(1, 10);
  const double pulled = corner_moved(wide, {spring(1)}).z();
  const double lifted = corner_moved(wide, {turned(1, 0)}).z();
  const double opened = corner_moved(wide, {turned(0, 1)}).y();
  for (const double gap : {0.1, 0.03, 0.01}) {
    const LinkageModel model = gapped_model(gap, 10);
    for (const double size : {0.01, 1.0, 100.0}) {
      SCOPED_TRACE(::testing::Message() << gap << ", " << size);
      EXPECT_NEAR(corner_moved(model, {spring(size)}).z() / pulled / size, 0.95, 0.03);
      EXPECT_NEAR(corner_moved(model, {turned(size, 0)}).z() / lifted / size, 0.98, 0.02);
      EXPECT_NEAR(corner_moved(model, {turned(0, size)}).y() / opened / size, 0.97, 0.02);
    }
  }
  // Nor does what is left of a load that is taken away.
  EXPECT_LT(corner_moved(gapped_model(0.03, 10),
                         {force_at(11, Eigen::Vector3d(0, 0, -15)),
                          [](Conditions& conditions) { conditions.loads.clear(); }})
                .norm(),
            1e-6);
  // Nor do large loads there hide smaller ones.
  const Eigen::Vector3d down(0, 0, -1500), aside(0, 15, 0);
  const auto both = [&](const LinkageModel& model) {
    return (corner_moved(model, {force_at(11, down), force_at(2, aside)}) -
            corner_moved(model, {force_at(11, down)}))
        .y();
  };
  const double moved = both(wide);
  EXPECT_GT(moved, 4e-4);
  EXPECT_NEAR(both(gapped_model(0.03, 10)), moved, 0.1 * moved);
}

TEST(HardEquilibria, EdgesOfJointsDoNotShrinkThroughZero) {
  // Rods that would rather be short than bend, whose joints are all pulled to one point.
  const LinkageModel model = grid_model(3, 3, 1.2, 4, {10, 1000, 1000, 1000});
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.shortest_joint_edge = 0.2;
  for (int j = 0; j < 9; ++j)
    conditions.springs.push_back({JointPoint{j}, 0.05 * state.joints()[j].position, 5});
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  double shortest = 1;
  for (int j = 0; j < 9; ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      shortest = std::min(shortest,
                          state.joints()[j].lengths[rod] / model.rest_lengths().terminal(rod, j));
    }
  }
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_GE(shortest, 0.2 * (1 - 1e-9));
  EXPECT_LT(shortest, 0.21);
}

TEST(HardEquilibria, SeveralComponents) {
  LineMesh mesh = testing::sheared_grid(3, 3, 1.0, 40);
  LineMesh both;
  both.vertices.resize(3, 27);
  both.edges.resize(2, 36);
  for (int k = 0; k < 3; ++k) {
    for (int v = 0; v < 9; ++v)
      both.vertices.col(9 * k + v) = mesh.vertices.col(v) + Eigen::Vector3d(0, 0, 300 * k);
    both.edges.middleCols(12 * k, 12) = mesh.edges.array() + 9 * k;
  }
  const LinkageModel model(build_linkage_graph(both), 6, kStrip);
  ASSERT_EQ(model.graph().components, 3);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  // One is pinned, one hangs on a spring, one floats.
  Conditions conditions;
  conditions.pins = {{0}};
  const Eigen::Vector3d target = state.joints()[9].position + Eigen::Vector3d(10, 20, 30);
  conditions.springs = {{JointPoint{9}, target, 0.5}};
  conditions.mean_opening_angle = 1.3;
  EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT((state.joints()[9].position - target).norm(), 1e-5);
  EXPECT_LT((state.joints()[22].position - LinkageState(model).joints()[22].position).norm(), 1e-9);
  // Weight holds on the pinned and the hanging one; the third one would fall.
  conditions.gravity = {Eigen::Vector3d(0, 0, -9.81), 1e-3};
  report = equilibrium.solve(state, conditions);
  EXPECT_EQ(report.status, EquilibriumStatus::kUnbalanced);
  EXPECT_NE(report.message.find("joint 18"), std::string::npos) << report.message;
  // A moment would spin it; two that cancel bend it.
  conditions.gravity = {};
  conditions.angles = {{22, 1.3}};  // else it would fold
  conditions.loads = {{18, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, 0.2), 0}};
  report = equilibrium.solve(state, conditions);
  EXPECT_EQ(report.status, EquilibriumStatus::kUnbalanced);
  EXPECT_NE(report.message.find("moment"), std::string::npos) << report.message;
  conditions.loads.push_back({26, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, -0.2), 0});
  report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
}

/// A wooden rod of 80 x 30 mm in N and m, stiff against what rounding moves.
constexpr RodStiffness kBeam{2.4e7, 1.28e4, 1.8e3, 2.2e3};

TEST(HardEquilibria, SeparateUnstressedRodsAreAMinimum) {
  Random random(1);
  for (const int rods : {1, 2, 5, 10, 20, 40}) {
    LineMesh mesh;
    mesh.vertices.resize(3, 2 * rods);
    mesh.edges.resize(2, rods);
    for (int r = 0; r < rods; ++r) {
      Eigen::Vector3d from, along;
      for (double& x : from) x = random.uniform(0, 5);
      for (double& x : along) x = random.normal();
      mesh.vertices.col(2 * r) = from;
      mesh.vertices.col(2 * r + 1) = from + along.normalized();
      mesh.edges.col(r) << 2 * r, 2 * r + 1;
    }
    for (const double far : {0.0, 300.0}) {  // from the origin
      LineMesh moved = mesh;
      moved.vertices.row(0).array() += far;
      const LinkageModel model(build_linkage_graph(moved), 6, kBeam);
      LinkageState state(model);
      const EquilibriumReport report = LinkageEquilibrium(model).solve(state, {});
      EXPECT_TRUE(report.converged()) << rods << " rods, " << far << ": " << report.message;
      EXPECT_EQ(report.escapes, 0);
      for (int s = 0; s < rods; ++s) {
        EXPECT_LT((state.vertex(model, s, 0) - moved.vertices.col(2 * s)).norm(), 1e-6)
            << "it stays where it is drawn";
      }
    }
  }
}

TEST(HardEquilibria, SeparateUnstressedGridsAreAMinimum) {
  LineMesh grid;
  grid.vertices.resize(3, 36);
  grid.edges.resize(2, 60);
  int edge = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      grid.vertices.col(6 * i + j) << i, j, 0;
      if (j < 5) grid.edges.col(edge++) << 6 * i + j, 6 * i + j + 1;
      if (i < 5) grid.edges.col(edge++) << 6 * i + j, 6 * i + j + 6;
    }
  }
  for (const int grids : {1, 4}) {
    LineMesh all;
    all.vertices.resize(3, 36 * grids);
    all.edges.resize(2, 60 * grids);
    for (int k = 0; k < grids; ++k) {
      all.vertices.middleCols(36 * k, 36) = grid.vertices.colwise() + Eigen::Vector3d(0, 0, 3 * k);
      all.edges.middleCols(60 * k, 60) = grid.edges.array() + 36 * k;
    }
    const LinkageModel model(build_linkage_graph(all), 6, kBeam);
    LinkageState state(model);
    const EquilibriumReport report = LinkageEquilibrium(model).solve(state, {});
    EXPECT_TRUE(report.converged()) << grids << " grids: " << report.message;
    EXPECT_LT(joint_distance(state, LinkageState(model)), 1e-6);
  }
}

TEST(HardEquilibria, HangsBelowASingleSpring) {
  // A pendulum: the spring holds no rotation, the weight does.
  const LinkageModel model = grid_model(3, 3, 1.2);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  const Eigen::Vector3d nail = state.joints()[0].position;
  conditions.springs = {{JointPoint{0}, nail, 2}};
  conditions.gravity = {Eigen::Vector3d(0, 0, -9.81), 1e-3};
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  ASSERT_TRUE(report.converged()) << report.message;
  double weight = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int e = 0; e < 6; ++e) {
      const double mass = (e == 0 || e == 5 ? 0.5 : 1) * 1e-3 *
                          model.rest_lengths().edge(model.graph(), model.variables(), s, e);
      weight += mass;
      centre += mass * 0.5 * (state.vertex(model, s, e) + state.vertex(model, s, e + 1));
    }
  }
  centre /= weight;
  EXPECT_NEAR(nail.z() - state.joints()[0].position.z(), weight * 9.81 / 2, 1e-6);
  EXPECT_LT((centre - nail).head<2>().norm(), 1e-4);
  EXPECT_LT(centre.z(), nail.z() - 20);
}

TEST(HardEquilibria, ASymmetricSaddleIsLeft) {
  // Compressed between stiff springs, a straight strip of cells buckles out of its plane.
  const LinkageModel model = grid_model(6, 2, std::numbers::pi / 2);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  for (const int j : {0, 5, 6, 11}) {
    Eigen::Vector3d target = state.joints()[j].position;
    target.x() = 100 + 0.997 * (target.x() - 100);
    conditions.springs.push_back({JointPoint{j}, target, 5});
  }
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_GE(report.escapes, 1);
  double height = 0;
  for (const JointState<double>& joint : state.joints())
    height = std::max(height, std::abs(joint.position.z()));
  EXPECT_GT(height, 3);
}

TEST(HardEquilibria, ASaddleIsDetectedBesideLargeForces) {
  // As above, but beside what a pinned joint carries the springs' forces are a trifle, which one
  // step balances: it must be seen all the same that this is no minimum.
  LineMesh mesh = testing::sheared_grid(6, 2, std::numbers::pi / 2, 40);
  const Eigen::Index strip = mesh.vertices.cols(), edges = mesh.edges.cols();
  mesh.vertices.conservativeResize(3, strip + 3);
  mesh.vertices.rightCols<3>() << 0, 40, 80, 500, 500, 520, 0, 0, 0;
  mesh.edges.conservativeResize(2, edges + 2);
  mesh.edges.rightCols<2>() << static_cast<int>(strip), static_cast<int>(strip) + 1,
      static_cast<int>(strip) + 1, static_cast<int>(strip) + 2;
  const LinkageModel model(build_linkage_graph(mesh), 6, kStrip);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  for (const int j : {0, 5, 6, 11}) {
    Eigen::Vector3d target = state.joints()[j].position;
    target.x() = 100 + 0.997 * (target.x() - 100);
    conditions.springs.push_back({JointPoint{j}, target, 5});
  }
  conditions.pins = {{12}};
  conditions.loads = {{12, Eigen::Vector3d(0, 0, 1e6), Eigen::Vector3d::Zero(), 0}};
  const EquilibriumReport report = equilibrium.solve(state, conditions, {.tolerance = 1e-10});
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_GE(report.escapes, 1);
  double height = 0;
  for (const JointState<double>& joint : state.joints())
    height = std::max(height, std::abs(joint.position.z()));
  EXPECT_GT(height, 3);
}

TEST(HardEquilibria, AWideTurnOfASingleAngle) {
  const LinkageModel model = grid_model(2, 2, 1.0);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.angles = {{0, 179 * kDegree}};
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_NEAR(state.joints()[0].opening_angle, 179 * kDegree, 1e-12);
}

/// Rounding grows with coordinates, and balance is judged by it.
TEST(EquilibriumHardCases, ATargetFarAwayTakesAFloatingLinkageThere) {
  const LinkageModel model = curved_model();
  for (const double away : {1e2, 1e4, 1e6}) {
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    const EquilibriumReport here = equilibrium.solve(state, {});
    ASSERT_TRUE(here.converged());
    const Eigen::Vector3d target = state.joints()[7].position + Eigen::Vector3d(0, away, 0);
    Conditions conditions;
    conditions.springs = {{JointPoint{7}, target, 1.0}};
    const EquilibriumReport there = equilibrium.solve(state, conditions);
    EXPECT_TRUE(there.converged()) << away << ": " << there.message;
    EXPECT_LT((state.joints()[7].position - target).norm(), 1e-9 * away);
    EXPECT_NEAR(there.energies.total(), here.energies.total(), 1e-4 * here.energies.total());
  }
}

}  // namespace
}  // namespace limber::rods
