#include "engine/session/linkages/unit_name.h"

#include <gtest/gtest.h>

namespace limber::session {
namespace {

TEST(UnitName, NamesWhatHasANameAndTheSizeOfOthers) {
  EXPECT_EQ(unit_name(1), "m");
  EXPECT_EQ(unit_name(0.01), "cm");
  EXPECT_EQ(unit_name(0.001), "mm");
  EXPECT_EQ(unit_name(0.0254), "units of 0.0254 m");
  EXPECT_EQ(unit_name(1e-6), "units of 1e-06 m");
}

}  // namespace
}  // namespace limber::session
