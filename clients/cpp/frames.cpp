#include "clients/cpp/frames.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "clients/cpp/array_numbers.h"
#include "clients/cpp/error.h"

namespace limber::client {
namespace {

ClientError malformed(const std::string& message) {
  return {v1::ERROR_CODE_MALFORMED, "", message};
}

Positions from_coordinates(const v1::Frames& frames, const v1::GetGeometryResponse* geometry) {
  if (geometry == nullptr || geometry->basis_hash() != frames.basis_hash())
    throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "basis_hash",
                      "these coordinates belong to another basis");
  const auto rest = real_numbers(geometry->rest(), 2, "rest positions");
  const bool is_far = geometry->rest().type() == v1::DATA_TYPE_FLOAT64;
  const auto basis = numbers<float>(geometry->basis(), v1::DATA_TYPE_FLOAT32, 3, "basis columns");
  const auto coordinates = numbers<float>(frames.data(), v1::DATA_TYPE_FLOAT32, 2, "coordinates");
  const auto frame_count = static_cast<std::size_t>(frames.data().shape(0));
  const auto size = static_cast<std::size_t>(frames.data().shape(1));
  const std::size_t dofs = rest.size();
  if (geometry->rest().shape(1) != 3 || basis.size() != dofs * size)
    throw malformed("coordinates, basis and rest shape do not fit each other");
  Positions positions{frame_count, dofs / 3, std::vector<double>(frame_count * dofs)};
  for (std::size_t frame = 0; frame < frame_count; ++frame) {
    const float* q = coordinates.data() + frame * size;
    for (std::size_t dof = 0; dof < dofs; ++dof) {
      const float* row = basis.data() + dof * size;
      double sum = rest[dof];
      for (std::size_t k = 0; k < size; ++k) sum += static_cast<double>(row[k]) * q[k];
      positions.values[frame * dofs + dof] = is_far ? sum : static_cast<float>(sum);
    }
  }
  return positions;
}

/// The server's rule for positions of double precision.
bool is_box_far(const double* origin, const double* extent) {
  constexpr double kFarSizes = 8;
  double farthest = 0, size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    farthest = std::max({farthest, std::abs(origin[axis]), std::abs(origin[axis] + extent[axis])});
    size = std::max(size, extent[axis]);
  }
  return farthest > kFarSizes * size;
}

Positions from_quantised(const v1::Frames& frames) {
  const auto data =
      numbers<std::uint16_t>(frames.data(), v1::DATA_TYPE_UINT16, 3, "quantised positions");
  const double origin[3] = {frames.origin().x(), frames.origin().y(), frames.origin().z()};
  const double extent[3] = {frames.extent().x(), frames.extent().y(), frames.extent().z()};
  Positions positions{frames.data().shape(0), frames.data().shape(1),
                      std::vector<double>(data.size())};
  const bool is_far = is_box_far(origin, extent);
  for (std::size_t i = 0; i < data.size(); ++i) {
    const double at = origin[i % 3] + data[i] * (extent[i % 3] / 65535.0);
    positions.values[i] = is_far ? at : static_cast<float>(at);
  }
  return positions;
}

}  // namespace

Positions decode(const v1::Frames& frames, const v1::GetGeometryResponse* geometry) {
  if (frames.encoding() == v1::ENCODING_COORDINATES) return from_coordinates(frames, geometry);
  const auto& shape = frames.data().shape();
  if (shape.size() != 3 || shape[2] != 3) throw malformed("positions are not frames x nodes x 3");
  if (frames.encoding() == v1::ENCODING_POSITIONS_QUANTISED) return from_quantised(frames);
  if (frames.encoding() != v1::ENCODING_POSITIONS && frames.encoding() != v1::ENCODING_SURFACE)
    throw ClientError(v1::ERROR_CODE_UNSUPPORTED, "encoding",
                      "frames in the unknown encoding " + std::to_string(frames.encoding()));
  return {shape[0], shape[1], real_numbers(frames.data(), 3, "positions")};
}

bool is_single(const Positions& positions) {
  return std::all_of(positions.values.begin(), positions.values.end(), [](double value) {
    return static_cast<double>(static_cast<float>(value)) == value;
  });
}

std::string npy(const Positions& positions) {
  const bool is_short = is_single(positions);
  std::string header = std::string("{'descr': '") + (is_short ? "<f4" : "<f8") +
                       "', 'fortran_order': False, 'shape': (" + std::to_string(positions.frames) +
                       ", " + std::to_string(positions.nodes) + ", 3), }";
  // The numbers start at a multiple of 64 bytes: 10 bytes of magic, version and length, the header,
  // a line feed.
  header.append(64 - (10 + header.size() + 1) % 64, ' ');
  header += '\n';
  std::string bytes = "\x93NUMPY";
  bytes += {'\x01', '\x00', static_cast<char>(header.size() & 0xff),
            static_cast<char>(header.size() >> 8)};
  bytes += header;
  if (is_short) {
    const std::vector<float> values(positions.values.begin(), positions.values.end());
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  } else {
    bytes.append(reinterpret_cast<const char*>(positions.values.data()),
                 positions.values.size() * sizeof(double));
  }
  return bytes;
}

}  // namespace limber::client
