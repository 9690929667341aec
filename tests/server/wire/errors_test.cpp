#include "server/wire/errors.h"

#include <gtest/gtest.h>

#include <new>

namespace limber::server {
namespace {

TEST(Errors, EngineErrorsKeepCodeFieldAndMessage) {
  const auto error = error_to_proto(Error(ErrorCode::kNotFound, "mesh.tets[3]", "gone"), "scene.");
  EXPECT_EQ(error.code(), proto::ERROR_CODE_NOT_FOUND);
  EXPECT_EQ(error.field(), "scene.mesh.tets[3]");
  EXPECT_EQ(error.message(), "gone");
  EXPECT_EQ(error_to_proto(Error(ErrorCode::kIo, "", "x"), "scene.").field(), "");
}

TEST(Errors, QuotedNamesWithZeroBytesDoNotEndAMessage) {
  const std::string quoted("\0.obj: no mesh", 14);
  EXPECT_EQ(error_to_proto(Error(ErrorCode::kIo, "", quoted)).message(), "?.obj: no mesh");
  EXPECT_EQ(error_to_proto(invalid("file", quoted)).message(), "?.obj: no mesh");
}

TEST(Errors, EveryEngineCodeHasItsOwnOnTheWire) {
  const ErrorCode last = ErrorCode::kInternal;
  std::set<proto::ErrorCode> codes;
  for (int i = 0; i <= static_cast<int>(last); ++i)
    codes.insert(to_proto(static_cast<ErrorCode>(i)));
  EXPECT_EQ(codes.size(), static_cast<std::size_t>(last) + 1);
  EXPECT_EQ(codes.count(proto::ERROR_CODE_UNSPECIFIED), 0u);
}

TEST(Errors, RefusalsCarryDetails) {
  const auto error = error_to_proto(limit_exceeded("frames", "frames", 10, 11), "scene.");
  EXPECT_EQ(error.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(error.field(), "frames");
  EXPECT_EQ(error.details().at("limit"), "10");
  EXPECT_EQ(error.details().at("value"), "11");
}

TEST(Errors, EverythingElseIsInternal) {
  EXPECT_EQ(error_to_proto(std::logic_error("x")).code(), proto::ERROR_CODE_INTERNAL);
  EXPECT_EQ(error_to_proto(std::bad_alloc()).code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

}  // namespace
}  // namespace limber::server
