#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/reduced/pose_data.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced {

/// Input of both kinds of cubature.
struct CubatureInput {
  const bodies::ElasticBody& body;
  const bodies::GradientOperator& gradient;
  const ScaledModes& modes;
  const Eigen::MatrixXd& basis;  // largest B worth trying, columns nested
  const PoseData& train;         // seen through all its columns, as are:
  const PoseData& validation;
  const ModelOptions& options;
  double limit;  // mean error on the validation poses that chosen sizes are to meet
};

/// q = map g(rs_modes z) + direct z on the first basis_size columns of B.
struct Cubature {
  int basis_size = 0;
  std::vector<int> tets;
  Eigen::MatrixXd rs_modes;  // 9T x R
  Eigen::MatrixXd map;       // h x 9T
  Eigen::MatrixXd direct;    // h x R
  bool met_limit = false;
};

/// Sizes that are 0 in the options are chosen. Among all (h, T) that meet the limit on the
/// validation poses, the cheapest per frame is taken, or the best found if none does.
[[nodiscard]] Cubature fit_cubature(const CubatureInput& input, const JobContext& job);
/// Weights hang on the basis: h is the smallest that leaves room for the cubature, then T the
/// fewest tets.
[[nodiscard]] Cubature weigh_cubature(const CubatureInput& input, const JobContext& job);

/// H g(Y z) + D z for the columns of z: h x S.
[[nodiscard]] Eigen::MatrixXd reduced_coordinates(const Eigen::MatrixXd& rs_modes,
                                                  const Eigen::MatrixXd& map,
                                                  const Eigen::MatrixXd& direct,
                                                  const Eigen::MatrixXd& z);

/// Smallest h with error_by_size[h - 1] <= limit; 0 if there is none.
[[nodiscard]] int smallest_size(const Eigen::VectorXd& error_by_size, double limit);

}  // namespace limber::reduced
