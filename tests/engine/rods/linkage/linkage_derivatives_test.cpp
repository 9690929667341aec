#include "engine/rods/linkage/linkage_derivatives.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/state_charts.h"
#include "tests/support/energy_conformance.h"

namespace limber::rods {
namespace {

using namespace testing;
using limber::testing::EnergyUnderTest;

enum class Place { kAtTheSource, kAway };

/// A bent linkage with rest lengths and sections of its own, and a point at its state or away from
/// it.
class LinkageDerivativesTest : public ::testing::TestWithParam<std::tuple<BendingForm, Place>> {
 protected:
  LinkageDerivativesTest()
      : model_(build_linkage_graph(mixed_mesh()), 4, kStiffness, std::get<0>(GetParam())),
        state_(model_),
        derivatives_(model_) {
    Random random(21);
    lengths_ = model_.segment_lengths();
    for (double& length : lengths_) length *= random.uniform(0.9, 1.1);
    model_.set_segment_lengths(lengths_);
    edges_ = model_.edge_lengths();
    for (double& edge : edges_) edge *= random.uniform(0.95, 1.05);
    sections_.resize(segments());
    for (double& section : sections_) section = random.uniform(0.8, 1.25);
    set(Eigen::VectorXd::Zero(segments()), edges_, sections_);
    for (int k = 0; k < 3; ++k)
      state_ = state_.moved(model_, random_increment(size(), 0.05, random));
    if (std::get<1>(GetParam()) == Place::kAway) increment_ = random_increment(size(), 0.2, random);
  }
  [[nodiscard]] Eigen::Index size() const { return model_.variables().size(); }
  [[nodiscard]] int segments() const { return model_.variables().segments(); }
  [[nodiscard]] LinkagePoint point() const { return {state_, increment_}; }
  [[nodiscard]] Eigen::VectorXd increment() const {
    return increment_.size() > 0 ? increment_ : Eigen::VectorXd(Eigen::VectorXd::Zero(size()));
  }
  [[nodiscard]] LinkageVector direction(unsigned seed) const {
    Random random(seed);
    LinkageVector v;
    v.unknowns = random_increment(size(), 1, random);
    v.lengths = random_increment(segments(), 1, random);
    v.edges = random_increment(edges_.size(), 0.3, random);
    v.sections = random_increment(segments(), 1, random);
    return v;
  }
  [[nodiscard]] static Eigen::VectorXd stacked(const LinkageVector& v) {
    Eigen::VectorXd all(v.unknowns.size() + v.lengths.size() + v.edges.size() + v.sections.size());
    all << v.unknowns, v.lengths, v.edges, v.sections;
    return all;
  }
  [[nodiscard]] LinkageVector split(const Eigen::VectorXd& all) const {
    return {all.head(size()), all.segment(size(), segments()),
            all.segment(size() + segments(), edges_.size()), all.tail(segments())};
  }
  /// Sizes of the model; what segments get beside them goes to their edges.
  void set(const Eigen::VectorXd& segments_more, const Eigen::VectorXd& edges,
           const Eigen::VectorXd& sections) {
    const RestLengths more = model_.rest_length_map().apply_to_change(segments_more);
    model_.set_edge_lengths(edges + model_.edge_numbers().listed(more));
    model_.set_section_scales(sections);
  }
  /// A function at the point a step along a direction on; the model's lengths come back.
  template <class Function>
  auto along(const LinkageVector& v, double h, const Function& function) {
    const auto part = [&](const Eigen::VectorXd& given, Eigen::Index count) -> Eigen::VectorXd {
      return given.size() > 0 ? Eigen::VectorXd(h * given) : Eigen::VectorXd::Zero(count);
    };
    set(part(v.lengths, segments()), edges_ + part(v.edges, edges_.size()),
        sections_ + part(v.sections, segments()));
    Eigen::VectorXd x = increment();
    if (v.unknowns.size() > 0) x += h * v.unknowns;
    const auto result = function(LinkagePoint{state_, x});
    set(Eigen::VectorXd::Zero(segments()), edges_, sections_);
    return result;
  }

  LinkageModel model_;
  LinkageState state_;
  LinkageDerivatives derivatives_;
  Eigen::VectorXd lengths_, edges_, sections_;
  Eigen::VectorXd increment_;
};

TEST_P(LinkageDerivativesTest, GradientIsThatOfTheAssembly) {
  LinkageAssembly assembly(model_);
  const LinkageState moved = state_.moved(model_, increment());
  Eigen::VectorXd gradient(size());
  assembly.gradient(moved, gradient);
  const Eigen::VectorXd expected = pulled_back(model_, state_, increment(), moved, gradient);
  const LinkageVector result = derivatives_.gradient(point());
  EXPECT_LT((result.unknowns - expected).norm(), 1e-12 * expected.norm());
}

TEST_P(LinkageDerivativesTest, ConformByUnknownsRestLengthsAndSectionsTogether) {
  LinkageAssembly assembly(model_);
  const auto at = [&](const Eigen::VectorXd& all, const auto& function) {
    const LinkageVector sizes = split(all);
    set(sizes.lengths, sizes.edges, sizes.sections);
    const auto result = function(LinkagePoint{state_, sizes.unknowns});
    set(Eigen::VectorXd::Zero(segments()), edges_, sections_);
    return result;
  };
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& all) {
    return at(all, [&](const LinkagePoint& p) {
      return assembly.energies(state_.moved(model_, p.increment)).total();
    });
  };
  energy.gradient = [&](const Eigen::VectorXd& all) -> Eigen::VectorXd {
    return at(all, [&](const LinkagePoint& p) { return stacked(derivatives_.gradient(p)); });
  };
  energy.hessian = [&](const Eigen::VectorXd& all) -> Eigen::MatrixXd {
    return at(all, [&](const LinkagePoint& p) {
      Eigen::MatrixXd hessian(all.size(), all.size());
      for (Eigen::Index i = 0; i < all.size(); ++i) {
        const Eigen::VectorXd unit = Eigen::VectorXd::Unit(all.size(), i);
        hessian.col(i) = stacked(derivatives_.second(p, split(unit)));
      }
      return hessian;
    });
  };
  Eigen::VectorXd all(size() + 2 * segments() + edges_.size());
  all << increment(), Eigen::VectorXd::Zero(segments()), edges_, sections_;
  limber::testing::expect_conforms(energy, all);
}

TEST_P(LinkageDerivativesTest, ProductsAtTheSourceAreTheAssembledMatrix) {
  // Matrices are assembled at sources, wherever the increment is.
  LinkageAssembly assembly(model_);
  Eigen::VectorXd gradient(size()), expected(size());
  CondensedMatrix matrix(model_.chains());
  assembly.hessian(state_, gradient, matrix);
  const LinkageVector v = direction(1);
  matrix.multiply(v.unknowns, expected);
  const LinkageVector product = derivatives_.second({state_}, {v.unknowns, {}});
  EXPECT_LT((product.unknowns - expected).norm(), 1e-12 * expected.norm());
}

TEST_P(LinkageDerivativesTest, ColumnsByLengthsAreTheProducts) {
  const LinkageDerivatives::ByLengths columns = derivatives_.by_lengths(point());
  const LinkageVector v = direction(2);
  const LinkageVector forward = derivatives_.second(point(), {{}, v.lengths});
  EXPECT_LT((columns.unknowns * v.lengths - forward.unknowns).norm(),
            1e-12 * forward.unknowns.norm());
  EXPECT_LT((columns.lengths * v.lengths - forward.lengths).norm(), 1e-12 * forward.lengths.norm());
  const LinkageVector back = derivatives_.second(point(), {v.unknowns, {}});
  EXPECT_LT((columns.unknowns.transpose() * v.unknowns - back.lengths).norm(),
            1e-12 * back.lengths.norm());
  // A length reaches no farther than the segments that share edges with its own.
  EXPECT_LT(columns.unknowns.nonZeros(), size() * segments() / 2);
}

TEST_P(LinkageDerivativesTest, ThirdAgreesWithDifferencesOfProducts) {
  const LinkageVector v = direction(3), w = direction(4);
  const LinkageVector only_x{w.unknowns, {}}, only_l{{}, w.lengths};
  const LinkageVector only_e{{}, {}, w.edges}, only_s{{}, {}, {}, w.sections};
  for (const LinkageVector& step : {w, only_x, only_l, only_e, only_s}) {
    for (const LinkageVector& first :
         {v, LinkageVector{v.unknowns, {}}, LinkageVector{{}, v.lengths},
          LinkageVector{{}, {}, v.edges}, LinkageVector{{}, {}, {}, v.sections}}) {
      const auto product = [&](const LinkagePoint& p) {
        return stacked(derivatives_.second(p, first));
      };
      const double h = 1e-4;
      const Eigen::VectorXd near = along(step, h, product) - along(step, -h, product);
      const Eigen::VectorXd far = along(step, 2 * h, product) - along(step, -2 * h, product);
      const Eigen::VectorXd difference = (8 * near - far) / (12 * h);
      const Eigen::VectorXd third = stacked(derivatives_.third(point(), first, step));
      EXPECT_LT((third - difference).norm(), 1e-7 * third.norm());
      EXPECT_GT(third.norm(), 1e-3);
    }
  }
}

TEST_P(LinkageDerivativesTest, ThirdIsSymmetricInItsThreeSlots) {
  const LinkageVector u = direction(5), v = direction(6), w = direction(7);
  const Eigen::VectorXd vw = stacked(derivatives_.third(point(), v, w));
  const Eigen::VectorXd wv = stacked(derivatives_.third(point(), w, v));
  const Eigen::VectorXd uw = stacked(derivatives_.third(point(), u, w));
  EXPECT_LT((vw - wv).norm(), 1e-12 * vw.norm());
  EXPECT_NEAR(vw.dot(stacked(u)), uw.dot(stacked(v)), 1e-11 * vw.norm() * stacked(u).norm());
}

TEST_P(LinkageDerivativesTest, ThirdTakesAShareOfTheSecondAlong) {
  const LinkageVector v = direction(10), w = direction(11);
  const Eigen::VectorXd third = stacked(derivatives_.third(point(), v, w));
  const Eigen::VectorXd second = stacked(derivatives_.second(point(), w));
  const Eigen::VectorXd both = stacked(derivatives_.third(point(), v, w, -0.4));
  EXPECT_LT((both - (third - 0.4 * second)).norm(), 1e-12 * both.norm());
}

TEST_P(LinkageDerivativesTest, DoNotDependOnThreads) {
  const LinkageVector v = direction(8), w = direction(9);
  const int before = thread_count();
  set_thread_count(1);
  const Eigen::VectorXd alone = stacked(derivatives_.third(point(), v, w));
  set_thread_count(3);
  EXPECT_EQ(stacked(derivatives_.third(point(), v, w)), alone);
  set_thread_count(before);
}

INSTANTIATE_TEST_SUITE_P(FormsAndPlaces, LinkageDerivativesTest,
                         ::testing::Combine(::testing::Values(BendingForm::kMaterialFrames,
                                                              BendingForm::kAveragedFrames,
                                                              BendingForm::kTurningAngle),
                                            ::testing::Values(Place::kAtTheSource, Place::kAway)));

TEST(RestLengthMap, IsLinearAndItsTransposeIsIts) {
  const LinkageModel model(build_linkage_graph(mixed_mesh()), 5, kStiffness);
  const RestLengthMap& map = model.rest_length_map();
  const int segments = map.segments();
  Random random(1);
  const Eigen::VectorXd a = random_increment(segments, 1, random);
  const Eigen::VectorXd drawn = model.segment_lengths();
  const RestLengths change = map.apply_to_change(a);
  const RestLengths rest = map.apply(drawn + 0.1 * a);
  RestLengths pull;
  pull.terminal.resize(2, model.variables().joints());
  for (double& value : pull.terminal.reshaped()) value = random.uniform(-1, 1);
  pull.free_edge = random_increment(segments, 1, random);
  double work = 0;
  for (int j = 0; j < model.variables().joints(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      if (!std::isfinite(change.terminal(rod, j))) continue;  // no such rod
      work += change.terminal(rod, j) * pull.terminal(rod, j);
      EXPECT_NEAR(rest.terminal(rod, j),
                  model.rest_lengths().terminal(rod, j) + 0.1 * change.terminal(rod, j), 1e-14);
    }
  }
  work += change.free_edge.dot(pull.free_edge);
  EXPECT_NEAR(map.transposed(pull).dot(a), work, 1e-13);
  // Lengths are kept: edges from joint to joint, terminal ones by half.
  for (int s = 0; s < segments; ++s) {
    double sum = 0;
    for (int e = 0; e < 5; ++e) {
      const auto& joints = model.graph().segments[s].joints;
      const bool shared = (e == 0 && joints[0] >= 0) || (e == 4 && joints[1] >= 0);
      sum += (shared ? 0.5 : 1) * rest.edge(model.graph(), model.variables(), s, e);
    }
    EXPECT_NEAR(sum, drawn[s] + 0.1 * a[s], 1e-14);
  }
}

TEST(RestLengthMap, RefusesLengthsThatLeaveNothingForFreeEdges) {
  LinkageModel model(build_linkage_graph(sheared_grid(3, 3, 1.1)), 5, kStiffness);
  const Eigen::VectorXd drawn = model.segment_lengths();
  EXPECT_EQ(drawn, drawn_lengths(model.graph()));
  for (int s = 0; s < drawn.size(); ++s) {
    Eigen::VectorXd lengths = drawn;
    lengths[s] = 1e-3;
    // Either its own terminal edges shrink along, or its neighbour's leave nothing.
    try {
      model.set_segment_lengths(lengths);
      EXPECT_GT(model.rest_lengths().free_edge[s], 0);
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), "lengths[" + std::to_string(s) + "]");
    }
  }
  EXPECT_THROW(model.set_segment_lengths(Eigen::VectorXd::Zero(drawn.size())), Error);
}

}  // namespace
}  // namespace limber::rods
