#include "server/wire/frames.h"
#include "server/wire/precise_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/checked_number.h"

namespace limber::server {
namespace {

void set_shape(proto::Array& array, proto::DataType type,
               std::initializer_list<Eigen::Index> shape) {
  array.set_type(type);
  for (const auto extent : shape) array.add_shape(static_cast<std::uint64_t>(extent));
}

template <class Number>
void set_numbers(const Number* numbers, Eigen::Index count, proto::Array& array) {
  array.set_data(numbers, static_cast<std::size_t>(count) * sizeof(Number));
}

/// @param positions  3 nodes x frames, float or double
template <class Matrix>
void quantise(const Matrix& positions, proto::Frames& frames) {
  using Number = typename Matrix::Scalar;
  const Eigen::Map<const Eigen::Matrix3X<Number>> points(positions.data(), 3, positions.size() / 3);
  Eigen::Vector3<Number> low = Eigen::Vector3<Number>::Zero(), high = low;
  if (points.cols() > 0) {
    low = points.rowwise().minCoeff();
    high = points.rowwise().maxCoeff();
  }
  const Eigen::Vector3d origin = low.template cast<double>();
  const Eigen::Vector3d extent = high.template cast<double>() - origin;
  const Eigen::Vector3<Number> scale =
      extent.unaryExpr([](double side) { return side > 0 ? 65535.0 / side : 0.0; })
          .template cast<Number>();
  std::vector<std::uint16_t> levels(static_cast<std::size_t>(points.size()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Number level = (points(axis, i) - low[axis]) * scale[axis];
      const Number bounded = std::min(Number{65535}, std::max(Number{0}, level + Number{0.5}));
      levels[static_cast<std::size_t>(3 * i + axis)] =
          to_whole<std::uint16_t>(std::floor(bounded)).value_or(0);
    }
  }
  frames.mutable_data()->set_data(levels.data(), levels.size() * sizeof(std::uint16_t));
  auto* from = frames.mutable_origin();
  from->set_x(origin.x()), from->set_y(origin.y()), from->set_z(origin.z());
  auto* size = frames.mutable_extent();
  size->set_x(extent.x()), size->set_y(extent.y()), size->set_z(extent.z());
  // Half a level, and the product's rounding in single precision (at most a 2^-7 of a level at
  // level 65535).
  frames.set_quantisation_error(extent.maxCoeff() / 65535.0 * (0.5 + 1.0 / 64.0));
}

template <class Matrix>
void put_positions(const Matrix& positions, proto::DataType type, proto::Encoding encoding,
                   proto::Frames& frames) {
  auto& array = *frames.mutable_data();
  const bool is_quantised = encoding == proto::ENCODING_POSITIONS_QUANTISED;
  set_shape(array, is_quantised ? proto::DATA_TYPE_UINT16 : type,
            {positions.cols(), positions.rows() / 3, 3});
  if (is_quantised) return quantise(positions, frames);
  set_numbers(positions.data(), positions.size(), array);
}

}  // namespace

bool is_of_positions(proto::Encoding encoding) {
  return encoding == proto::ENCODING_POSITIONS || encoding == proto::ENCODING_POSITIONS_QUANTISED;
}

proto::Frames frames_of(proto::ResultInfo result, proto::Encoding encoding, FrameRange range) {
  proto::Frames frames;
  *frames.mutable_result() = std::move(result);
  frames.set_encoding(encoding == proto::ENCODING_UNSPECIFIED ? proto::ENCODING_COORDINATES
                                                              : encoding);
  frames.set_first_frame(static_cast<std::uint32_t>(range.first));
  frames.set_frame_count(static_cast<std::uint32_t>(range.count));
  return frames;
}

void set_positions(const Eigen::Ref<const Eigen::MatrixXf>& positions, proto::Encoding encoding,
                   proto::Frames& frames) {
  put_positions(positions, proto::DATA_TYPE_FLOAT32, encoding, frames);
}

void set_positions(const Eigen::MatrixXd& positions, scene::Precision precision,
                   proto::Encoding encoding, proto::Frames& frames) {
  if (precision == scene::Precision::kFloat64) {
    put_positions(positions, proto::DATA_TYPE_FLOAT64, encoding, frames);
  } else {
    set_positions(positions.cast<float>(), encoding, frames);
  }
}

void set_coordinates(const Eigen::Ref<const Eigen::MatrixXf>& coordinates, proto::Frames& frames) {
  auto& array = *frames.mutable_data();
  set_shape(array, proto::DATA_TYPE_FLOAT32, {coordinates.cols(), coordinates.rows()});
  set_numbers(coordinates.data(), coordinates.size(), array);
}

void set_coordinates(const Eigen::MatrixXd& coordinates, scene::Precision precision,
                     proto::Frames& frames) {
  if (precision == scene::Precision::kFloat32)
    return set_coordinates(coordinates.cast<float>(), frames);
  auto& array = *frames.mutable_data();
  set_shape(array, proto::DATA_TYPE_FLOAT64, {coordinates.cols(), coordinates.rows()});
  set_numbers(coordinates.data(), coordinates.size(), array);
}

FrameRange frame_range(std::uint32_t first, std::uint32_t count, int frame_count) {
  const auto frames = static_cast<std::uint64_t>(frame_count);
  if (first >= frames) {
    throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "first_frame",
                  fmt::format("frame {} of {}", first, frames));
  }
  const std::uint64_t requested = count == 0 ? frames - first : count;
  if (first + requested > frames) {
    throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "frame_count",
                  fmt::format("{} frames from {}, there are {}", requested, first, frames));
  }
  return {to_whole<int>(first).value(), to_whole<int>(requested).value()};
}

}  // namespace limber::server
