#include "server/wire/version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "limber/v1/service.pb.h"
#include "server/wire/wire_check.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Refusal refusal_of(const google::protobuf::Message& message) {
  try {
    check_wire(message.SerializeAsString(), *message.GetDescriptor());
  } catch (const Refusal& refusal) {
    return refusal;
  }
  ADD_FAILURE() << "taken: " << message.ShortDebugString();
  return {proto::ERROR_CODE_UNSPECIFIED, "", ""};
}

TEST(Version, OtherProtocolsSayWhichSideIsToBeUpdated) {
  const std::string own = std::string("this server (") + server_version() + ")";
  EXPECT_EQ(other_protocol(2),
            "this client speaks protocol 2, " + own + " protocol 1: update the server");
  EXPECT_THAT(other_protocol(0), StartsWith("the request names no protocol version"));
}

TEST(Version, WhatNewerClientsSendIsRefusedAndNotDropped) {
  proto::Request of_later;
  of_later.GetReflection()->MutableUnknownFields(&of_later)->AddLengthDelimited(63, "");
  Refusal refusal = refusal_of(of_later);
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_UNSUPPORTED);
  EXPECT_THAT(refusal.what(), HasSubstr("does not know requests of number 63: update the server"));

  proto::Request request;
  auto* edit = request.mutable_edit()->add_edits();
  edit->GetReflection()->MutableUnknownFields(edit)->AddLengthDelimited(40, "");
  refusal = refusal_of(request);
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_UNSUPPORTED);
  EXPECT_EQ(refusal.field(), "edits[0]");
  EXPECT_THAT(refusal.what(), HasSubstr("does not know edits of number 40: update the server"));
  EXPECT_EQ(refusal.details().at("server_version"), server_version());

  request.Clear();
  auto* push = request.mutable_edit()->add_edits()->mutable_push_beam_node();
  push->GetReflection()->MutableUnknownFields(push)->AddVarint(9, 1);
  refusal = refusal_of(request);
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(refusal.what(), HasSubstr("update the server"));

  request.Clear();
  request.mutable_edit()->add_edits()->mutable_set_material()->set_variables(
      static_cast<proto::MaterialVariables>(77));
  refusal = refusal_of(request);
  EXPECT_EQ(refusal.field(), "edits[0].set_material.variables");
  EXPECT_THAT(refusal.what(), HasSubstr("77 is no value of MaterialVariables; this server ("));
}

TEST(Version, TheFirstRequestMayHaveFieldsOfLaterVersions) {
  proto::Request request;
  auto* info = request.mutable_get_server_info();
  info->set_client_version("9.0.0");
  auto* more = info->GetReflection()->MutableUnknownFields(info);
  more->AddVarint(50, 1);
  more->AddLengthDelimited(51, "more");
  EXPECT_NO_THROW(check_wire(request.SerializeAsString(), *proto::Request::descriptor()));
  for (int i = 0; i < 100; ++i) more->AddVarint(50, 1);
  EXPECT_EQ(refusal_of(request).code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  more->Clear();
  more->AddGroup(52)->AddVarint(1, 1);
  EXPECT_EQ(refusal_of(request).code(), proto::ERROR_CODE_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace limber::server
