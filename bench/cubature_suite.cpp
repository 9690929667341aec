// Error against the number of cubature tets on the flower, with the curve that the author of
// space-time editing published (flower_cubature_curve.txt; another flower, other poses). Rows are
// scalar weights, the paper's method, and fitted maps, on the same basis of 80 columns and the same
// poses.
//
// *_training_error: root mean square over training poses of |q - q_hat| / |q| (eq. 15), the usual
// value of such curves. *_error: mean over poses held out of the training, of whole displacements
// against full RS; basis_error: the error of the basis alone.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>

#include "bench/suite.h"
#include "engine/reduced/basis_choice.h"
#include "engine/reduced/cubature.h"
#include "engine/reduced/fitted_cubature.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/weighted_cubature.h"

namespace limber::bench {
namespace {

using reduced::PoseData;

constexpr int kStep = 10, kLargestFitted = 100;

/// Relative errors by the number of samples; empty without the public data.
std::map<int, double> published_curve(const SuiteOptions& options) {
  std::map<int, double> curve;
  std::ifstream file(std::filesystem::path(options.shared_folder) / "data" / "bodies" /
                     "flower_cubature_curve.txt");
  for (std::string line; std::getline(file, line);) {
    int count = 0;
    double percent = 0;
    if (std::sscanf(line.c_str(), "n = %d relerr = %lf", &count, &percent) == 2)
      curve[count] = percent / 100;
  }
  return curve;
}

double training_error(const PoseData& poses, const Eigen::MatrixXd& q) {
  return std::sqrt(
      ((poses.q - q).colwise().squaredNorm().array() / poses.q.colwise().squaredNorm().array())
          .mean());
}

struct Errors {
  double training = 0, held_out = 0;
  int tets = 0;  // the least that are at least as many as the curve's point says
};

Errors errors_of(const Eigen::MatrixXd& rs_modes, const Eigen::MatrixXd& map,
                 const Eigen::MatrixXd& direct, const PoseData& train, const PoseData& test) {
  const auto q = [&](const PoseData& poses) {
    return reduced::reduced_coordinates(rs_modes, map, direct, poses.z);
  };
  return {training_error(train, q(train)), reduced::relative_errors(test, q(test)).mean(),
          static_cast<int>(rs_modes.rows() / reduced::kRsSize)};
}

/// Common input of both cubatures.
struct Setting {
  NamedBody named;
  reduced::ScaledModes modes;
  std::unique_ptr<reduced::FullReconstruction> full;
  Eigen::MatrixXd basis;
  PoseData train, validation, test;
};

Setting make_setting(NamedBody named) {
  Setting setting{std::move(named), {}, {}, {}, {}, {}, {}};
  const bodies::ElasticBody& body = setting.named.body;
  reduced::ModelOptions options;
  options.basis_size = 80;
  const bodies::ModalBasis modal = bodies::modal_analysis(body, {});
  setting.modes = reduced::scale_modes(body, modal);
  setting.full = std::make_unique<reduced::FullReconstruction>(body);
  const reduced::TrainingSet set =
      reduced::make_training_set(body, setting.modes, *setting.full, options, {});
  reduced::ModelReport report;
  reduced::BasisChoice choice = reduced::choose_basis(
      {body, modal, setting.modes, *setting.full, set, {}, options}, report, {});
  setting.train =
      reduced::project_training(set, setting.modes, *setting.full, choice.basis, 0.01, {});
  setting.test = set.test.project(choice.basis);
  setting.basis = std::move(choice.basis);
  setting.validation = std::move(choice.validation);
  return setting;
}

std::map<int, Errors> weighted_curve(const Setting& setting, int most) {
  constexpr Eigen::Index kPoses = 400;  // one number per tet is fitted
  PoseData train = setting.train;
  train.z = train.z.leftCols(kPoses).eval();
  train.q = train.q.leftCols(kPoses).eval();
  train.norm = train.norm.head(kPoses).eval();
  reduced::WeightedCubature cubature(setting.full->gradient(), setting.modes.modes, setting.basis,
                                     {}, train, 1);
  const Eigen::MatrixXd direct = Eigen::MatrixXd::Zero(setting.basis.cols(), setting.modes.count());
  std::map<int, Errors> curve;
  // Weights fall to zero and come back: a step may pass a point of the curve.
  for (int point = kStep; point <= most && cubature.add_tet({});) {
    const std::vector<int> tets = cubature.tets();
    if (static_cast<int>(tets.size()) < point) continue;
    const Eigen::MatrixXd rs_modes =
        reduced::linear_coordinates(setting.full->gradient(), tets, setting.modes.modes);
    curve[point] = errors_of(rs_modes, cubature.map(), direct, train, setting.test);
    point += kStep;
  }
  return curve;
}

std::map<int, Errors> fitted_curve(const Setting& setting, int most) {
  // Which tets there are to choose from matters little: every few is enough.
  std::vector<int> pool;
  const int tets = setting.full->gradient().tet_count();
  for (int i = 0; i < 400; ++i) pool.push_back(static_cast<int>(std::int64_t{i} * tets / 400));
  reduced::FittedCubature cubature(setting.full->gradient(), setting.modes.modes,
                                   setting.basis.transpose() * setting.modes.modes, setting.train,
                                   setting.validation, pool, {});
  std::map<int, Errors> curve;
  for (int count = 1; count <= most && cubature.add_best_tet({}); ++count) {
    if (count % kStep != 0) continue;
    const Eigen::MatrixXd map = cubature.fit().map;
    curve[count] =
        errors_of(cubature.rs_modes(), map, cubature.direct(map), setting.train, setting.test);
  }
  return curve;
}

}  // namespace

void cubature_suite(const SuiteOptions& options, Recorder& recorder) {
  const std::map<int, double> published = published_curve(options);
  if (published.empty()) recorder.note("cubature: no published curve (public data not found)");
  recorder.note("cubature: poses and basis of the flower");
  const Setting setting = make_setting(*load_body("flower", options));
  const double basis_error = reduced::relative_errors(setting.test, setting.test.q).mean();
  const int most = options.quick ? 80 : 200;
  recorder.note("cubature: weights");
  const std::map<int, Errors> weights = weighted_curve(setting, most);
  recorder.note("cubature: fitted maps");
  const std::map<int, Errors> fitted = fitted_curve(setting, std::min(most, kLargestFitted));
  for (const auto& [count, errors] : weights) {
    Case row;
    row["scene"] = "flower";
    row["tets"] = setting.full->gradient().tet_count();
    row["cubature_tets"] = count;
    if (const auto found = published.find(count); found != published.end())
      row["published_error"] = found->second;
    row["weights_tets"] = errors.tets;
    row["weights_training_error"] = errors.training;
    row["weights_error"] = errors.held_out;
    if (const auto found = fitted.find(count); found != fitted.end()) {
      row["fitted_training_error"] = found->second.training;
      row["fitted_error"] = found->second.held_out;
    }
    row["basis_error"] = basis_error;
    recorder.add(row);
  }
}

}  // namespace limber::bench
