#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"

namespace limber::client {

/// Positions, frames x nodes x 3, row by row [length unit].
struct Positions {
  std::size_t frames = 0;
  std::size_t nodes = 0;
  std::vector<double> values;  // of single precision, but far from the origin
};

/// Frames of any encoding as positions. `geometry` is needed for coordinates: rest + basis .
/// coordinates.
/// @throws ClientError MALFORMED for shapes and lengths that do not fit, FAILED_PRECONDITION for
/// another basis
[[nodiscard]] Positions decode(const v1::Frames& frames, const v1::GetGeometryResponse* geometry);

/// Whether float32 holds all of them as they are.
[[nodiscard]] bool is_single(const Positions& positions);

/// Bytes of a NumPy .npy file, version 1.0: float32 where that holds them, else float64; C order,
/// frames x nodes x 3.
[[nodiscard]] std::string npy(const Positions& positions);

}  // namespace limber::client
