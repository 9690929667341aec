#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/bodies/tet_mesh.h"
#include "server/wire/errors.h"

namespace limber::server {

/// Checks type, shape and byte length against each other.
/// @param field  path of the array, for errors
/// @throws Refusal INVALID_ARGUMENT naming field + ".type", ".shape" or ".data"
void check_array(const proto::Array& array, const std::string& field, int dimensions);

/// rows x 3, float32 or float64, to 3 x rows. @throws Refusal; NaN and infinity are refused with
/// their row.
[[nodiscard]] Eigen::Matrix3Xd decode_points(const proto::Array& array, const std::string& field);

/// rows x 4, int32, to 4 x rows. Values are not compared with the number of nodes here.
[[nodiscard]] bodies::TetNodes decode_tets(const proto::Array& array, const std::string& field);

/// rows x 2, int32, to 2 x rows. Values are not compared with anything here.
[[nodiscard]] Eigen::Matrix2Xi decode_pairs(const proto::Array& array, const std::string& field);

/// rows x 3, int32, to 3 x rows. Values are not compared with anything here.
[[nodiscard]] Eigen::Matrix3Xi decode_triples(const proto::Array& array, const std::string& field);

/// rows x 2, float32 or float64. @throws Refusal as decode_points()
[[nodiscard]] std::vector<Eigen::Vector2d> decode_polygon(const proto::Array& array,
                                                          const std::string& field);
/// To rows x 2, float64.
[[nodiscard]] proto::Array encode_polygon(const std::vector<Eigen::Vector2d>& polygon);

/// frames x nodes x 3, float32 or float64, to 3 nodes x frames.
/// @throws Refusal where `nodes` or `frames` differ from the shape
[[nodiscard]] Eigen::MatrixXd decode_motion(const proto::Array& array, const std::string& field,
                                            int nodes, int frames);

/// 3 nodes x frames to frames x nodes x 3, float64.
[[nodiscard]] proto::Array encode_motion(const Eigen::MatrixXd& motion);
/// 3 x rows to rows x 3, float32, far from the origin float64 (scene::precision_for()).
[[nodiscard]] proto::Array encode_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points);
/// k x rows to rows x k, int32.
[[nodiscard]] proto::Array encode_indices(const Eigen::Ref<const Eigen::MatrixXi>& indices);
/// rows x columns, float64, row by row.
[[nodiscard]] proto::Array encode_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
/// The same back. @throws Refusal for another type, other dimensions, NaN and infinity
[[nodiscard]] Eigen::MatrixXd decode_matrix(const proto::Array& array, const std::string& field);
/// 3 x rows to rows x 3, float64.
[[nodiscard]] proto::Array encode_points_float64(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

[[nodiscard]] Eigen::VectorXd decode_numbers(
    const google::protobuf::RepeatedField<double>& numbers);
void encode_numbers(const Eigen::VectorXd& numbers, google::protobuf::RepeatedField<double>& to);

}  // namespace limber::server
