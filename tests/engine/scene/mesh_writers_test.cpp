#include "engine/scene/formats/mesh_writers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <zlib.h>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "engine/base/error.h"
#include "engine/scene/formats/base64.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/samples/samples.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

bodies::TetMesh bird_with_materials() {
  bodies::TetMesh mesh = make_sample("bird").mesh;
  mesh.materials = {{1e6, 0.45, 1000}, {2e5, 0.3, 500}};
  for (int t = 0; t < mesh.tet_count(); ++t) mesh.tet_material.push_back(t % 2);
  return mesh;
}

TEST(MeshWriters, VtuComesBackToTheLastBit) {
  const bodies::TetMesh mesh = bird_with_materials();
  const MeshReading back = read_mesh({"a.vtu", write_vtu(mesh), {}});
  EXPECT_EQ(back.mesh.nodes, mesh.nodes);
  EXPECT_EQ(back.mesh.tets, mesh.tets);
  EXPECT_TRUE(back.warnings.empty());
  const MeshReading single = read_mesh({"a.vtu", write_vtu(mesh, Precision::kFloat32), {}});
  EXPECT_EQ(single.mesh.nodes, mesh.nodes.cast<float>().cast<double>());
}

TEST(MeshWriters, MshComesBackToTheLastBit) {
  const bodies::TetMesh mesh = make_sample("bird").mesh;
  const MeshReading back = read_mesh({"a.msh", write_msh(mesh), {}});
  EXPECT_EQ(back.mesh.nodes, mesh.nodes);
  EXPECT_EQ(back.mesh.tets, mesh.tets);
}

TEST(MeshWriters, FramesAreMovedAndSayByHowMuch) {
  const bodies::TetMesh mesh = make_sample("bird").mesh;
  Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(3 * mesh.node_count(), -1, 1);
  const std::string bytes = write_vtu_frame(mesh, u, Precision::kFloat64);
  EXPECT_THAT(bytes.substr(0, 600), HasSubstr("Name=\"displacement\" NumberOfComponents=\"3\""));
  const MeshReading back = read_mesh({"a.vtu", bytes, {}});
  EXPECT_EQ(back.mesh.nodes.reshaped(), (mesh.nodes.reshaped() + u).eval());
  EXPECT_THROW(static_cast<void>(write_vtu_frame(mesh, u.head(7))), Error);
}

TEST(MeshWriters, PvdListsTimesAndEscapesNames) {
  const std::string text = write_pvd({"frame_0.vtu", "a & \"b\" <c>.vtu"}, {0, 1.0 / 30});
  EXPECT_THAT(text,
              HasSubstr("<DataSet timestep=\"0\" group=\"\" part=\"0\" file=\"frame_0.vtu\"/>"));
  EXPECT_THAT(text, HasSubstr("timestep=\"0.03333333333333333\""));
  EXPECT_THAT(text, HasSubstr("file=\"a &amp; &quot;b&quot; &lt;c&gt;.vtu\""));
  EXPECT_THROW(static_cast<void>(write_pvd({"a"}, {})), Error);
}

/// What meshio, an independent reader, sees in our files.
TEST(MeshWriters, MeshioReadsTheFiles) {
  if (std::system("/usr/bin/python3 -c 'import meshio' 2>/dev/null") != 0)
    GTEST_SKIP() << "python3-meshio is not there";
  const std::string folder = ::testing::TempDir();
  const bodies::TetMesh mesh = bird_with_materials();
  const Eigen::VectorXd u = Eigen::VectorXd::Constant(3 * mesh.node_count(), 0.25);
  std::ofstream(folder + "/limber_a.vtu", std::ios::binary) << write_vtu(mesh);
  std::ofstream(folder + "/limber_b.vtu", std::ios::binary) << write_vtu_frame(mesh, u);
  std::ofstream(folder + "/limber_a.msh", std::ios::binary) << write_msh(mesh);
  const std::string script =
      "import meshio, numpy as np\n"
      "a, b, c = (meshio.read('" +
      folder +
      "/limber_' + f) for f in ('a.vtu', 'b.vtu', 'a.msh'))\n"
      "assert a.points.dtype == np.float64 and a.points.shape == (" +
      std::to_string(mesh.node_count()) +
      ", 3)\n"
      "assert a.cells[0].data.shape == (" +
      std::to_string(mesh.tet_count()) +
      ", 4)\n"
      "assert set(np.unique(a.cell_data['density'][0])) == {500.0, 1000.0}\n"
      "assert b.points.dtype == np.float32 and np.all(b.point_data['displacement'] == 0.25)\n"
      "assert np.allclose(b.points, a.points + 0.25, atol=1e-6)\n"
      "assert np.array_equal(c.points, a.points) and np.array_equal(c.cells[0].data, "
      "a.cells[0].data)\n";
  std::ofstream(folder + "/limber_check.py") << script;
  EXPECT_EQ(std::system(("/usr/bin/python3 " + folder + "/limber_check.py").c_str()), 0);
}

/// VTU encodings that meshio does not write, made by hand: a tet in every encoding of its arrays
/// are allowed stored.
template <typename Number>
std::string packed(std::initializer_list<Number> numbers, bool big_endian) {
  std::string bytes;
  for (Number number : numbers) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    if (big_endian) std::reverse(raw, raw + sizeof number);
    bytes.append(raw, sizeof number);
  }
  return bytes;
}

std::string hand_made_vtu(bool big_endian, bool compressed, bool base64, bool split_base64) {
  const std::string arrays[4] = {packed<float>({0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2.5}, big_endian),
                                 packed<std::int64_t>({3, 0, 1, 2}, big_endian),
                                 packed<std::uint16_t>({4}, big_endian),
                                 packed<std::int8_t>({10}, big_endian)};
  std::string appended;
  std::size_t offsets[4];
  for (int i = 0; i < 4; ++i) {
    std::string header =
        packed<std::uint32_t>({static_cast<std::uint32_t>(arrays[i].size())}, big_endian);
    std::string data = arrays[i];
    if (compressed) {
      // Two blocks, the second shorter.
      const std::size_t block = arrays[i].size() / 2 + 1;
      std::string parts[2];
      for (int p = 0; p < 2; ++p) {
        const std::string part =
            p == 0 ? data.substr(0, block) : data.substr(std::min(block, data.size()));
        uLongf size = compressBound(static_cast<uLong>(part.size()));
        parts[p].resize(size);
        compress(reinterpret_cast<Bytef*>(parts[p].data()), &size,
                 reinterpret_cast<const Bytef*>(part.data()), static_cast<uLong>(part.size()));
        parts[p].resize(size);
      }
      const bool two = data.size() > block;
      const auto u32 = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
      header =
          two ? packed<std::uint32_t>({2, u32(block), u32(data.size() - block),
                                       u32(parts[0].size()), u32(parts[1].size())},
                                      big_endian)
              : packed<std::uint32_t>({1, u32(data.size()), 0, u32(parts[0].size())}, big_endian);
      data = two ? parts[0] + parts[1] : parts[0];
    }
    offsets[i] = appended.size();
    appended += !base64        ? header + data
                : split_base64 ? formats::encode_base64(header) + formats::encode_base64(data)
                               : formats::encode_base64(header + data);
  }
  const auto array = [&](const char* type, const char* name, int i) {
    return std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
           "\" format=\"appended\" offset=\"" + std::to_string(offsets[i]) + "\"/>";
  };
  return std::string("<?xml version=\"1.0\"?><VTKFile type=\"UnstructuredGrid\" byte_order=\"") +
         (big_endian ? "BigEndian" : "LittleEndian") + "\"" +
         (compressed ? " compressor=\"vtkZLibDataCompressor\"" : "") +
         "><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>" +
         array("Float32", "P", 0) + "</Points><Cells>" + array("Int64", "connectivity", 1) +
         array("UInt16", "offsets", 2) + array("Int8", "types", 3) +
         "</Cells></Piece></UnstructuredGrid><AppendedData encoding=\"" +
         (base64 ? "base64" : "raw") + "\">\n _" + appended + "\n</AppendedData></VTKFile>";
}

TEST(MeshFormats, VtuIsReadInEveryEncoding) {
  for (int variant = 0; variant < 16; ++variant) {
    const bool big = variant & 1, compressed = variant & 2, base64 = variant & 4,
               split = variant & 8;
    SCOPED_TRACE(variant);
    const MeshReading reading =
        read_mesh({"a.vtu", hand_made_vtu(big, compressed, base64, split), {}});
    EXPECT_EQ(reading.mesh.tets.col(0), Eigen::Vector4i(3, 0, 1, 2));
    EXPECT_EQ(reading.mesh.nodes.col(3), Eigen::Vector3d(0, 0, 2.5));
  }
}

TEST(Base64, MatchesRfc4648) {
  const std::pair<std::string, std::string> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, code] : vectors) {
    EXPECT_EQ(formats::encode_base64(plain), code);
    EXPECT_EQ(formats::decode_base64(code, 100), plain);
  }
  EXPECT_EQ(formats::decode_base64("Zg==\n Zm8=", 100), "ffo");
  EXPECT_EQ(formats::decode_base64("Zm9vYmFy", 4), "foob");
  for (const char* bad : {"Z", "Zg", "Zg=", "=Zg=", "Zg=A", "Z*=="})
    EXPECT_FALSE(formats::decode_base64(bad, 100)) << bad;
}

}  // namespace
}  // namespace limber::scene
