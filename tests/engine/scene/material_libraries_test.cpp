#include <gtest/gtest.h>

#include "engine/scene/formats/surface_formats.h"

namespace limber::scene {
namespace {

using Names = std::vector<std::string>;

TEST(MaterialLibraries, AreNamedByTheirLinesWithoutFolders) {
  EXPECT_EQ(material_libraries("v 0 0 0\nmtllib paint.mtl\r\nf 1 1 1\n"), Names{"paint.mtl"});
  EXPECT_EQ(material_libraries("mtllib\ttextures/a b.MTL \nmtllib b.mtl"),
            (Names{"a b.MTL", "b.mtl"}));
}

TEST(MaterialLibraries, NoOtherFileIsOne) {
  EXPECT_EQ(material_libraries("mtllib ../../.ssh/id_rsa\nmtllib /etc/passwd\nmtllib ..\nmtllib\n"
                               "mtllibrary x.mtl\n# mtllib y.mtl\n"),
            Names{});
  EXPECT_EQ(material_libraries(""), Names{});
}

}  // namespace
}  // namespace limber::scene
