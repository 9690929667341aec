#include "server/wire/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace limber::server {
namespace {

void set_shape(proto::Array& array, proto::DataType type,
               std::initializer_list<Eigen::Index> shape) {
  array.set_type(type);
  for (const auto extent : shape) array.add_shape(static_cast<std::uint64_t>(extent));
}

void quantise(const Eigen::Ref<const Eigen::MatrixXf>& positions, proto::Frames& frames) {
  const Eigen::Map<const Eigen::Matrix3Xf> points(positions.data(), 3, positions.size() / 3);
  Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = Eigen::Vector3f::Zero();
  if (points.cols() > 0) {
    low = points.rowwise().minCoeff();
    high = points.rowwise().maxCoeff();
  }
  const Eigen::Vector3d origin = low.cast<double>();
  const Eigen::Vector3d extent = high.cast<double>() - origin;
  const Eigen::Vector3f scale =
      extent.unaryExpr([](double side) { return side > 0 ? 65535.0 / side : 0.0; }).cast<float>();
  std::vector<std::uint16_t> levels(static_cast<std::size_t>(points.size()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const float level = (points(axis, i) - low[axis]) * scale[axis];
      levels[static_cast<std::size_t>(3 * i + axis)] =
          static_cast<std::uint16_t>(std::min(65535.0f, std::max(0.0f, level + 0.5f)));
    }
  }
  frames.mutable_data()->set_data(levels.data(), levels.size() * sizeof(std::uint16_t));
  auto* from = frames.mutable_origin();
  from->set_x(origin.x()), from->set_y(origin.y()), from->set_z(origin.z());
  auto* size = frames.mutable_extent();
  size->set_x(extent.x()), size->set_y(extent.y()), size->set_z(extent.z());
  // Half a level, and the single-precision product's rounding (at most a 2^-7 of a level at level
  // 65535).
  frames.set_quantisation_error(extent.maxCoeff() / 65535.0 * (0.5 + 1.0 / 64.0));
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
  auto& array = *frames.mutable_data();
  const bool is_quantised = encoding == proto::ENCODING_POSITIONS_QUANTISED;
  set_shape(array, is_quantised ? proto::DATA_TYPE_UINT16 : proto::DATA_TYPE_FLOAT32,
            {positions.cols(), positions.rows() / 3, 3});
  if (is_quantised) return quantise(positions, frames);
  array.set_data(positions.data(), static_cast<std::size_t>(positions.size()) * sizeof(float));
}

void set_coordinates(const Eigen::Ref<const Eigen::MatrixXf>& coordinates, proto::Frames& frames) {
  auto& array = *frames.mutable_data();
  set_shape(array, proto::DATA_TYPE_FLOAT32, {coordinates.cols(), coordinates.rows()});
  array.set_data(coordinates.data(), static_cast<std::size_t>(coordinates.size()) * sizeof(float));
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
  return {static_cast<int>(first), static_cast<int>(requested)};
}

}  // namespace limber::server
