#include "server/wire/arrays.h"
#include "server/wire/precise_frames.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "engine/base/checked_number.h"

namespace limber::server {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays on the wire are little-endian");

std::size_t size_of(proto::DataType type) {
  switch (type) {
    case proto::DATA_TYPE_FLOAT32:
      return 4;
    case proto::DATA_TYPE_FLOAT64:
      return 8;
    case proto::DATA_TYPE_INT32:
      return 4;
    case proto::DATA_TYPE_UINT16:
      return 2;
    default:
      return 0;
  }
}

void demand_extent(const proto::Array& array, const std::string& field, int dimension,
                   std::uint64_t expected, const char* what) {
  if (array.shape(dimension) != expected) {
    throw invalid(fmt::format("{}.shape[{}]", field, dimension),
                  fmt::format("{} {}, expected {}", array.shape(dimension), what, expected));
  }
}

/// Rows or columns, which may be many where there are none of the others.
/// @throws Refusal
int extent_of(const proto::Array& array, const std::string& field, int dimension) {
  const auto extent = to_whole<int>(array.shape(dimension));
  if (!extent)
    throw invalid(fmt::format("{}.shape[{}]", field, dimension), "more than 2^31 - 1 of them");
  return *extent;
}

/// All of the array's bytes. For an empty one, `to` may be null, which memcpy must not be given.
void copy_bytes(const proto::Array& array, void* to) {
  if (!array.data().empty()) std::memcpy(to, array.data().data(), array.data().size());
}

/// Copies row-major numbers of either precision to doubles; the layouts agree (last index fastest =
/// first row of a column-major matrix fastest).
void read_floats(const proto::Array& array, const std::string& field, double* out,
                 std::size_t count, std::size_t row_length) {
  if (array.type() == proto::DATA_TYPE_FLOAT64) {
    copy_bytes(array, out);
  } else if (array.type() == proto::DATA_TYPE_FLOAT32) {
    const char* from = array.data().data();
    for (std::size_t i = 0; i < count; ++i) {
      float value;
      std::memcpy(&value, from + i * sizeof(float), sizeof(float));
      out[i] = static_cast<double>(value);
    }
  } else {
    throw invalid(field + ".type", "float32 or float64 is expected");
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(out[i])) {
      throw invalid(fmt::format("{}.data[{}]", field, i),
                    fmt::format("row {} holds {}, not a finite number", i / row_length, out[i]));
    }
  }
}

}  // namespace

void check_array(const proto::Array& array, const std::string& field, int dimensions) {
  const std::size_t unit = size_of(array.type());
  if (unit == 0) throw invalid(field + ".type", "the type of the array's numbers is missing");
  if (array.shape_size() != dimensions) {
    throw invalid(field + ".shape",
                  fmt::format("{} dimensions, expected {}", array.shape_size(), dimensions));
  }
  std::uint64_t bytes = unit;
  for (const std::uint64_t extent : array.shape()) {
    if (__builtin_mul_overflow(bytes, extent, &bytes))
      throw invalid(field + ".shape", "the product of extents overflows");
  }
  if (bytes != array.data().size()) {
    throw invalid(field + ".data",
                  fmt::format("{} bytes, but type and shape say {}", array.data().size(), bytes));
  }
}

Eigen::Matrix3Xd decode_points(const proto::Array& array, const std::string& field) {
  check_array(array, field, 2);
  demand_extent(array, field, 1, 3, "columns");
  Eigen::Matrix3Xd points(3, extent_of(array, field, 0));
  read_floats(array, field, points.data(), static_cast<std::size_t>(points.size()), 3);
  return points;
}

namespace {

template <int kColumns>
Eigen::Matrix<int, kColumns, Eigen::Dynamic> decode_rows(const proto::Array& array,
                                                         const std::string& field) {
  check_array(array, field, 2);
  if (array.type() != proto::DATA_TYPE_INT32) throw invalid(field + ".type", "int32 is expected");
  demand_extent(array, field, 1, kColumns, "columns");
  Eigen::Matrix<int, kColumns, Eigen::Dynamic> rows(kColumns, extent_of(array, field, 0));
  copy_bytes(array, rows.data());
  return rows;
}

}  // namespace

Eigen::Matrix2Xi decode_pairs(const proto::Array& array, const std::string& field) {
  return decode_rows<2>(array, field);
}

Eigen::Matrix3Xi decode_triples(const proto::Array& array, const std::string& field) {
  return decode_rows<3>(array, field);
}

std::vector<Eigen::Vector2d> decode_polygon(const proto::Array& array, const std::string& field) {
  check_array(array, field, 2);
  demand_extent(array, field, 1, 2, "columns");
  Eigen::Matrix2Xd points(2, extent_of(array, field, 0));
  read_floats(array, field, points.data(), static_cast<std::size_t>(points.size()), 2);
  std::vector<Eigen::Vector2d> polygon;
  for (Eigen::Index i = 0; i < points.cols(); ++i) polygon.emplace_back(points.col(i));
  return polygon;
}

proto::Array encode_polygon(const std::vector<Eigen::Vector2d>& polygon) {
  Eigen::MatrixX2d rows(static_cast<Eigen::Index>(polygon.size()), 2);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = polygon[i].transpose();
  return encode_matrix(rows);
}

bodies::TetNodes decode_tets(const proto::Array& array, const std::string& field) {
  check_array(array, field, 2);
  return decode_rows<4>(array, field);
}

Eigen::MatrixXd decode_motion(const proto::Array& array, const std::string& field, int nodes,
                              int frames) {
  check_array(array, field, 3);
  demand_extent(array, field, 0, static_cast<std::uint64_t>(frames), "frames");
  demand_extent(array, field, 1, static_cast<std::uint64_t>(nodes), "nodes");
  demand_extent(array, field, 2, 3, "columns");
  Eigen::MatrixXd motion(3 * static_cast<Eigen::Index>(nodes), frames);
  read_floats(array, field, motion.data(), static_cast<std::size_t>(motion.size()),
              static_cast<std::size_t>(3 * nodes));
  return motion;
}

proto::Array encode_motion(const Eigen::MatrixXd& motion) {
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(static_cast<std::uint64_t>(motion.cols()));
  array.add_shape(static_cast<std::uint64_t>(motion.rows() / 3));
  array.add_shape(3);
  array.set_data(motion.data(), static_cast<std::size_t>(motion.size()) * sizeof(double));
  return array;
}

proto::Array encode_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  return encode_points(points, scene::precision_for(points));
}

proto::Array encode_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                           scene::Precision precision) {
  if (precision == scene::Precision::kFloat64) return encode_points_float64(points);
  const Eigen::Matrix3Xf narrow = points.cast<float>();
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT32);
  array.add_shape(static_cast<std::uint64_t>(narrow.cols()));
  array.add_shape(3);
  array.set_data(narrow.data(), static_cast<std::size_t>(narrow.size()) * sizeof(float));
  return array;
}

proto::Array encode_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = matrix;
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(static_cast<std::uint64_t>(rows.rows()));
  array.add_shape(static_cast<std::uint64_t>(rows.cols()));
  array.set_data(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(double));
  return array;
}

Eigen::MatrixXd decode_matrix(const proto::Array& array, const std::string& field) {
  check_array(array, field, 2);
  if (array.type() != proto::DATA_TYPE_FLOAT64)
    throw invalid(field + ".type", "float64 is expected");
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(
      extent_of(array, field, 0), extent_of(array, field, 1));
  copy_bytes(array, rows.data());
  if (!rows.allFinite()) throw invalid(field + ".data", "finite numbers are expected");
  return rows;
}

proto::Array encode_points_float64(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  const Eigen::Matrix3Xd dense = points;
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(static_cast<std::uint64_t>(dense.cols()));
  array.add_shape(3);
  array.set_data(dense.data(), static_cast<std::size_t>(dense.size()) * sizeof(double));
  return array;
}

proto::Array encode_indices(const Eigen::Ref<const Eigen::MatrixXi>& indices) {
  const Eigen::MatrixXi dense = indices;
  proto::Array array;
  array.set_type(proto::DATA_TYPE_INT32);
  array.add_shape(static_cast<std::uint64_t>(dense.cols()));
  array.add_shape(static_cast<std::uint64_t>(dense.rows()));
  array.set_data(dense.data(), static_cast<std::size_t>(dense.size()) * sizeof(int));
  return array;
}

Eigen::VectorXd decode_numbers(const google::protobuf::RepeatedField<double>& numbers) {
  return Eigen::VectorXd::Map(numbers.data(), numbers.size());
}

void encode_numbers(const Eigen::VectorXd& numbers, google::protobuf::RepeatedField<double>& to) {
  to.Assign(numbers.begin(), numbers.end());
}

}  // namespace limber::server
