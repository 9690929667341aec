// Small .vtu files whose arrays are large once decoded: refused before memory is taken.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <cstring>
#include <functional>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/vtu_series.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kMiB = std::size_t{1} << 20;

struct Array {
  const char* type;
  std::size_t bytes;  // zeros
};

/// A piece whose points, connectivity, offsets and types are zeros, compressed in blocks of 1 MiB.
std::string bomb(const std::vector<Array>& arrays, int pieces = 1) {
  std::string block(compressBound(kMiB), '\0');
  const std::string zeros(kMiB, '\0');
  uLongf packed = block.size();
  compress(reinterpret_cast<Bytef*>(block.data()), &packed,
           reinterpret_cast<const Bytef*>(zeros.data()), zeros.size());
  block.resize(packed);
  std::string appended, piece;
  const char* const names[] = {"Points", "connectivity", "offsets", "types"};
  for (std::size_t a = 0; a < arrays.size(); ++a) {
    const std::size_t blocks = arrays[a].bytes / kMiB;
    if (a == 1) piece += "<Cells>";
    piece += std::string(a == 0 ? "<Points>" : "") + "<DataArray type=\"" + arrays[a].type +
             "\" Name=\"" + names[a] + "\" format=\"appended\" offset=\"" +
             std::to_string(appended.size()) + "\"/>" + (a == 0 ? "</Points>" : "");
    const auto entry = [&](std::uint32_t value) {
      char raw[4];
      std::memcpy(raw, &value, 4);
      appended.append(raw, 4);
    };
    entry(static_cast<std::uint32_t>(blocks));
    entry(kMiB);
    entry(0);
    for (std::size_t b = 0; b < blocks; ++b) entry(static_cast<std::uint32_t>(packed));
    for (std::size_t b = 0; b < blocks; ++b) appended += block;
  }
  piece = "<Piece>" + piece + "</Cells></Piece>";
  std::string text =
      "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" "
      "compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>";
  for (int i = 0; i < pieces; ++i) text += piece;
  return text + "</UnstructuredGrid><AppendedData encoding=\"raw\">_" + appended +
         "</AppendedData></VTKFile>";
}

std::string limit_refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded) << error.what();
    return error.what();
  }
  return "accepted";
}

void read_within(const std::string& content, std::size_t limit) {
  (void)read_mesh({"a.vtu", content, {}}, {limit});
}

/// What a process of its own takes more for the action at its peak [MiB].
double peak_of(const std::function<void()>& action) {
  int ends[2];
  if (pipe(ends) != 0) return -1;
  const pid_t child = fork();
  if (child == 0) {
    const auto peak = [] {
      rusage usage{};
      getrusage(RUSAGE_SELF, &usage);
      return usage.ru_maxrss;  // [KiB]
    };
    const long before = peak();
    try {
      action();
    } catch (const Error&) {
    }
    const long more = peak() - before;
    _exit(write(ends[1], &more, sizeof more) == sizeof more ? 0 : 1);
  }
  close(ends[1]);
  long more = -1;
  const bool is_told = ::read(ends[0], &more, sizeof more) == sizeof more;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return is_told ? static_cast<double>(more) / 1024 : -1;
}

TEST(VtuLimits, ArraysAreLimitedInTheirSum) {
  // Each would do: the points take 24 MiB and as much for their bytes, the connectivity as much
  // again.
  const std::string content =
      bomb({{"Float64", 24 * kMiB}, {"Int64", 24 * kMiB}, {"Int64", kMiB}, {"UInt8", kMiB}});
  EXPECT_LT(content.size(), kMiB / 8);
  const std::string message = limit_refusal([&] { read_within(content, 64 * kMiB); });
  EXPECT_THAT(message, HasSubstr("a.vtu:"));
  EXPECT_THAT(message, HasSubstr("64 MiB"));
}

TEST(VtuLimits, OneArrayThatManyPiecesNameCountsForEach) {
  const std::string content =
      bomb({{"Float32", 3 * kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}}, 1000);
  EXPECT_LT(content.size(), 2 * kMiB);
  EXPECT_THAT(limit_refusal([&] { read_within(content, 512 * kMiB); }), HasSubstr("512 MiB"));
}

TEST(VtuLimits, BytesThatBecomeEightTimesAsLargeCountAsWhatTheyBecome) {
  // 60 MiB of cell types, a byte each.
  const std::string content =
      bomb({{"Float32", 3 * kMiB}, {"UInt8", kMiB}, {"UInt8", 60 * kMiB}, {"UInt8", kMiB}});
  EXPECT_THAT(limit_refusal([&] { read_within(content, 256 * kMiB); }), HasSubstr("256 MiB"));
}

TEST(VtuLimits, PeakMemoryStaysBelowTheLimit) {
  constexpr std::size_t kLimit = 96 * kMiB;
  const std::vector<std::vector<Array>> bombs = {
      {{"Float64", 1000 * kMiB}, {"Int64", kMiB}, {"Int64", kMiB}, {"UInt8", kMiB}},
      {{"Float64", 21 * kMiB}, {"UInt8", 1000 * kMiB}, {"Int64", kMiB}, {"UInt8", kMiB}},
      {{"Float32", 3 * kMiB}, {"UInt8", 4 * kMiB}, {"UInt8", kMiB}, {"UInt8", 1000 * kMiB}},
      {{"Float32", 6 * kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}}};
  for (std::size_t i = 0; i < bombs.size(); ++i) {
    const std::string content = bomb(bombs[i]);
    const double peak = peak_of([&] { read_within(content, kLimit); });
    ASSERT_GE(peak, 0);
    // The text of the file is there three times.
    EXPECT_LT(peak, 96 + 4.0 * static_cast<double>(content.size()) / kMiB + 8) << i;
  }
}

TEST(VtuLimits, AMeshOfItsOwnSizeIsRead) {
  bodies::TetMesh mesh;
  constexpr int kTets = 20'000;
  mesh.nodes = Eigen::Matrix3Xd::Random(3, 4 * kTets);
  mesh.tets.resize(4, kTets);
  for (int t = 0; t < kTets; ++t) mesh.tets.col(t) << 4 * t, 4 * t + 1, 4 * t + 2, 4 * t + 3;
  const std::string content =
      write_vtu_frame(mesh, Eigen::VectorXd::Zero(12 * kTets), Precision::kFloat64);
  // A tet with four nodes of its own has a KiB, as servers give it by --max-tets.
  const MeshReading reading = read_mesh({"a.vtu", content, {}}, {1024 * kTets});
  EXPECT_EQ(reading.mesh.tets.cols(), kTets);
  EXPECT_EQ(limit_refusal([&] { read_within(content, 64 * kTets); }).substr(0, 6), "a.vtu:");
}

TEST(VtuLimits, AMotionIsRefusedAtItsFirstFrame) {
  const std::string frame =
      bomb({{"Float64", 3 * kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}, {"UInt8", kMiB}});
  int calls = 0;
  const auto series = [&] {
    (void)read_vtu_series(
        "motion", 100'000,
        [&](std::size_t) {
          ++calls;
          return VtuFrame{"f.vtu", frame};
        },
        0, std::size_t{1} << 30);
  };
  EXPECT_THAT(limit_refusal(series),
              HasSubstr("100000 frames of 131072 points take more than 1024 MiB"));
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace limber::scene
