#include "engine/base/hash.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <set>
#include <string>

namespace limber {
namespace {

TEST(ContentHash, KnownDigestOfNothing) {
  // XXH3 128 of the empty input, from the specification of xxHash.
  EXPECT_EQ(ContentHash().hex(), "99aa06d3014798d86001c324468d497f");
}

TEST(ContentHash, FramingDistinguishesSplits) {
  std::set<std::string> digests;
  digests.insert(ContentHash().add("ab").add("c").hex());
  digests.insert(ContentHash().add("a").add("bc").hex());
  digests.insert(ContentHash().add("abc").hex());
  digests.insert(ContentHash().add("abc").add("").hex());
  EXPECT_EQ(digests.size(), 4u);
}

TEST(ContentHash, MatricesCountShapeAndBits) {
  const Eigen::MatrixXd wide = Eigen::MatrixXd::Constant(2, 3, 1.5);
  Eigen::MatrixXd tall = Eigen::MatrixXd::Constant(3, 2, 1.5);
  EXPECT_NE(ContentHash().add(wide).hex(), ContentHash().add(tall).hex());
  const std::string before = ContentHash().add(tall).hex();
  EXPECT_EQ(ContentHash().add(tall).hex(), before);
  tall(2, 1) = std::nextafter(1.5, 2);
  EXPECT_NE(ContentHash().add(tall).hex(), before);
}

TEST(ContentHash, DigestMayBeTakenInBetween) {
  ContentHash hash;
  hash.add(1);
  const std::string first = hash.hex();
  EXPECT_EQ(first.size(), 32u);
  hash.add(2.0);
  EXPECT_NE(hash.hex(), first);
  EXPECT_EQ(hash.hex(), ContentHash().add(1).add(2.0).hex());
}

}  // namespace
}  // namespace limber
