#include "server/wire/enum_table.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

enum class Engine { kFirst, kSecond, kThird };
enum Wire { WIRE_UNSPECIFIED = 0, WIRE_SECOND = 1, WIRE_FIRST = 2, WIRE_OTHER = 3 };

constexpr EnumTable<Engine, Wire, WIRE_FIRST> kTable{{Engine::kSecond, WIRE_SECOND},
                                                     {Engine::kFirst, WIRE_FIRST},
                                                     {Engine::kThird, WIRE_UNSPECIFIED}};

static_assert(enumerator_count<Engine>() == 3);
static_assert(kTable.encode(Engine::kFirst) == WIRE_FIRST);
static_assert(kTable.decode(WIRE_SECOND) == Engine::kSecond);

TEST(EnumTable, WhatHasNoRowIsTheFirst) {
  EXPECT_EQ(kTable.decode(WIRE_UNSPECIFIED), Engine::kThird) << "a row of its own";
  EXPECT_EQ(kTable.decode(WIRE_OTHER), Engine::kSecond);
}

TEST(EnumTable, ValuesOutsideOfTheEnumAreABrokenInvariant) {
  EXPECT_ANY_THROW((void)kTable.encode(static_cast<Engine>(7)));
}

}  // namespace
}  // namespace limber::server
