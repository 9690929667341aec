// Linkages against the public code's equilibria (linkages.json, burd_norestlen).

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "engine/base/degrees.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/newton_path.h"

namespace limber::rods {
namespace {

using testing::linkage_file;
using testing::NewtonPath;

constexpr int kDriver = 20;
// A rectangle 3 x 0.75 of E = 3000, nu = 0.38; GJ from the public code's finite elements.
constexpr RodStiffness kBurd{6750, 5062.5, 316.40625, 386.3121963558732};

struct KnownBurd {
  int edges;
  BendingForm form;
  double closed;
  double closed_degrees;
  double deployed;  // 0: takes too long for a test
};

class BurdTest : public ::testing::TestWithParam<KnownBurd> {};

std::vector<std::vector<double>> read_rows(const std::string& name) {
  std::ifstream file(testing::shared_file("reference/" + name));
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream text(line);
    rows.emplace_back();
    for (std::string word; std::getline(text, word, ',');) rows.back().push_back(std::stod(word));
  }
  return rows;
}

TEST_P(BurdTest, ClosesAndDeploysAsThePublicCode) {
  if (!std::filesystem::exists(linkage_file("burd_flat_opt_scaled"))) GTEST_SKIP() << "no data";
  const KnownBurd& known = GetParam();
  const LinkageModel model(
      build_linkage_graph(scene::read_line_mesh_file(linkage_file("burd_flat_opt_scaled"))),
      known.edges, kBurd, known.form);
  NewtonPath path(model, kDriver);
  EXPECT_NEAR(path.settle(), known.closed, 1e-6 * known.closed);
  const double closed = path.state.mean_opening_angle();
  EXPECT_NEAR(closed / kDegree, known.closed_degrees, 1e-5);
  const bool reported = known.edges == 10 && known.form == BendingForm::kMaterialFrames;
  const auto rows = read_rows("burd_norestlen_joints.csv");
  if (reported) {
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const JointState<double>& joint = path.state.joints()[j];
      EXPECT_LT((joint.position - Eigen::Vector3d(rows[j][4], rows[j][5], rows[j][6])).norm(),
                1e-4);
      EXPECT_NEAR(joint.opening_angle, rows[j][7], 1e-6);
    }
  }
  if (known.deployed == 0) return;
  const int steps = 50;
  double energy = 0;
  for (int k = 1; k <= steps; ++k)
    energy = path.settle_at(closed + (95 * kDegree - closed) * k / steps);
  EXPECT_NEAR(energy, known.deployed, 1e-5 * known.deployed);
  if (reported) {
    for (std::size_t j = 0; j < rows.size(); ++j)
      EXPECT_NEAR(path.state.joints()[j].opening_angle, rows[j][11], 1e-4) << j;
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllSubdivisions, BurdTest,
    ::testing::Values(KnownBurd{5, BendingForm::kMaterialFrames, 0.06551205849886217,
                                4.033412271125626, 43.49874337567044},
                      KnownBurd{10, BendingForm::kMaterialFrames, 0.06523042613060336,
                                4.0293544329659845, 43.312507597142925},
                      KnownBurd{20, BendingForm::kMaterialFrames, 0.0651515779525022,
                                4.027778902521677, 43.27535043206037},
                      KnownBurd{40, BendingForm::kMaterialFrames, 0.06512391871666919,
                                4.027078547971706, 43.267049465093265},
                      KnownBurd{80, BendingForm::kMaterialFrames, 0.06511264696364637,
                                4.026747701921831, 0},
                      KnownBurd{10, BendingForm::kAveragedFrames, 0.06523042613060545,
                                4.029354432957529, 43.28301686520897}));

}  // namespace
}  // namespace limber::rods
