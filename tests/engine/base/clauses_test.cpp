#include "engine/base/clauses.h"

#include <gtest/gtest.h>

namespace limber {
namespace {

std::string joined(std::string message, const std::string& clause) {
  append_clause(message, clause);
  return message;
}

TEST(Clauses, TakeThePlaceOfAFullStop) {
  EXPECT_EQ(joined("Stopped at the iteration limit.", "3 mm are missed"),
            "Stopped at the iteration limit; 3 mm are missed");
  EXPECT_EQ(joined("no step lowers the energy", "3 mm are missed"),
            "no step lowers the energy; 3 mm are missed");
}

TEST(Clauses, AddNothingToNothing) {
  EXPECT_EQ(joined("", "3 mm are missed"), "3 mm are missed");
  EXPECT_EQ(joined("Cancelled.", ""), "Cancelled.");
  EXPECT_EQ(joined("", ""), "");
}

}  // namespace
}  // namespace limber
