#include "engine/base/nearest_name.h"

#include <gtest/gtest.h>

#include <string>

namespace limber {
namespace {

TEST(NearestName, FindsWhatAMisspeltNameMeans) {
  constexpr std::string_view names[] = {"forces", "fixed vertices", "label", "meshLabel"};
  EXPECT_EQ(nearest_name("force", names), "forces");
  EXPECT_EQ(nearest_name("froces", names), "forces");
  EXPECT_EQ(nearest_name("Fixed_Vertices", names), "fixed vertices");
  EXPECT_EQ(nearest_name("labels", names), "label");
  EXPECT_EQ(nearest_name("gravity", names), "");
  EXPECT_EQ(nearest_name("", names), "");
  EXPECT_EQ(nearest_name(std::string(100000, 'x'), names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
}

}  // namespace
}  // namespace limber
