#include "engine/scene/formats/point_cache.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/error.h"
#include "engine/scene/formats/byte_reader.h"

namespace limber::scene {
namespace {

/// Header: char[12] "POINTCACHE2\0", int32 version, int32 points, float start, float rate, int32
/// samples.
constexpr std::string_view kMagic("POINTCACHE2\0", 12);
constexpr std::size_t kCacheHeaderBytes = 32;
constexpr auto kOrder = formats::ByteOrder::kLittle;

[[noreturn]] void refuse_cache(const std::string& name, const std::string& message,
                               ErrorCode code = ErrorCode::kInvalidArgument) {
  throw Error(code, name, message);
}

template <typename Number>
void append(std::string& bytes, Number number) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

}  // namespace

PointCache read_pc2(const std::string& name, std::string_view content) {
  if (content.substr(0, kMagic.size()) != kMagic)
    refuse_cache(name, "does not begin with 'POINTCACHE2'");
  if (content.size() < kCacheHeaderBytes) refuse_cache(name, "ends inside its header");
  const auto version = formats::decode<std::int32_t>(content.data() + 12, kOrder);
  if (version != 1) {
    refuse_cache(name, "version " + std::to_string(version) + " is not supported (1 is)",
                 ErrorCode::kUnsupported);
  }
  const std::int64_t points = formats::decode<std::int32_t>(content.data() + 16, kOrder);
  const std::int64_t samples = formats::decode<std::int32_t>(content.data() + 28, kOrder);
  if (points < 0 || samples < 0) refuse_cache(name, "a negative number of points or samples");
  // A few bytes would be work for minutes.
  if (points == 0 && samples > 0)
    refuse_cache(name, "has " + std::to_string(samples) + " samples of no points");
  // Both fit 31 bits, so the product cannot overflow 64.
  const auto expected = static_cast<std::uint64_t>(points) * static_cast<std::uint64_t>(samples);
  if (expected > content.size() || content.size() != kCacheHeaderBytes + 12 * expected) {
    refuse_cache(name, "has " + std::to_string(content.size()) + " bytes, not those of " +
                           std::to_string(samples) + " samples of " + std::to_string(points) +
                           " points");
  }
  PointCache cache;
  cache.start_frame = formats::decode<float>(content.data() + 20, kOrder);
  cache.frames_per_sample = formats::decode<float>(content.data() + 24, kOrder);
  cache.positions.resize(static_cast<Eigen::Index>(3 * points), static_cast<Eigen::Index>(samples));
  if (expected > 0)
    std::memcpy(cache.positions.data(), content.data() + kCacheHeaderBytes, 12 * expected);
  for (Eigen::Index sample = 0; sample < cache.positions.cols(); ++sample) {
    if (cache.positions.col(sample).allFinite()) continue;
    Eigen::Index at = 0;
    while (std::isfinite(cache.positions(at, sample))) ++at;
    refuse_cache(name, "the position of point " + std::to_string(at / 3) + " in sample " +
                           std::to_string(sample) + " is not finite");
  }
  return cache;
}

std::string write_pc2(const PointCache& cache) {
  if (cache.positions.rows() % 3 != 0 ||
      cache.positions.rows() / 3 > std::numeric_limits<std::int32_t>::max() ||
      cache.positions.cols() > std::numeric_limits<std::int32_t>::max()) {
    throw Error(ErrorCode::kInvalidArgument, "positions",
                "the positions have " + std::to_string(cache.positions.rows()) +
                    " rows, not three per point");
  }
  std::string bytes(kMagic);
  append(bytes, std::int32_t{1});
  append<std::int32_t>(bytes, cache.point_count());
  append(bytes, cache.start_frame);
  append(bytes, cache.frames_per_sample);
  append<std::int32_t>(bytes, cache.sample_count());
  const std::size_t size = static_cast<std::size_t>(cache.positions.size()) * sizeof(float);
  if (size > 0) bytes.append(reinterpret_cast<const char*>(cache.positions.data()), size);
  return bytes;
}

}  // namespace limber::scene
