#include "server/wire/readable.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "engine/scene/issue.h"
#include "server/wire/errors.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

const std::string kOther = "\xEF\xBF\xBD";

TEST(ServerReadable, KeepsWhatIsUtf8) {
  for (const std::string text : {"", "a b\n", "\xC3\xA4", "\xE2\x82\xAC", "\xF0\x9F\x98\x80",
                                 "\xED\x9F\xBF", "\xEE\x80\x80", "\xF4\x8F\xBF\xBF"})
    EXPECT_EQ(readable(text), text);
}

TEST(ServerReadable, ReplacesBytesOfNoCharacter) {
  EXPECT_EQ(readable("a\xFF"
                     "b\xFE"),
            "a" + kOther + "b" + kOther);
  EXPECT_EQ(readable(std::string("\0a", 2)), kOther + "a");
  EXPECT_EQ(readable("\xC3"), kOther);                                         // cut
  EXPECT_EQ(readable("\xE2\x82z"), kOther + kOther + "z");                     // cut by another one
  EXPECT_EQ(readable("\xC0\x80"), kOther + kOther);                            // overlong
  EXPECT_EQ(readable("\xE0\x9F\xBF"), kOther + kOther + kOther);               // overlong
  EXPECT_EQ(readable("\xED\xA0\x80"), kOther + kOther + kOther);               // a surrogate
  EXPECT_EQ(readable("\xF4\x90\x80\x80"), kOther + kOther + kOther + kOther);  // beyond the last
}

/// Messages of readers repeat what is in a file. As bytes that are no UTF-8 no client could read
/// the reply.
TEST(ServerReadable, ErrorsAndIssuesAreMessagesThatCanBeRead) {
  const std::string bytes = "line 3: \xFF is no number";
  const proto::Error error = error_to_proto(Error(ErrorCode::kInvalidArgument, "a\xFE.inp", bytes));
  proto::Error again;
  ASSERT_TRUE(again.ParseFromString(error.SerializeAsString()));
  EXPECT_EQ(again.message(), "line 3: " + kOther + " is no number");
  EXPECT_EQ(again.field(), "a" + kOther + ".inp");
  for (const proto::Issue& issue :
       {encode_warning("mesh", bytes),
        encode_fault({proto::ERROR_CODE_INVALID_ARGUMENT, "mesh\xFF", bytes}),
        encode_issue({scene::Issue::Severity::kError, "mesh\xFF", bytes})}) {
    proto::Issue read;
    EXPECT_TRUE(read.ParseFromString(issue.SerializeAsString()));
    EXPECT_EQ(read.message(), "line 3: " + kOther + " is no number");
  }
}

TEST(ServerReadable, LongIssuesAreCutAsErrorsAre) {
  EXPECT_LT(encode_warning("mesh", std::string(1'000'000, 'x')).message().size(), 4100U);
}

}  // namespace
}  // namespace limber::server
