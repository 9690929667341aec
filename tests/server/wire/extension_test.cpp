#include "server/wire/extension.h"

#include <gtest/gtest.h>

#include <cmath>

#include "limber/v1/common.pb.h"
#include "limber/v1/service.pb.h"
#include "tests/server/wire/refused_field.h"

namespace limber::server {
namespace {

using limber::server::testing::refused_field;

proto::Vector3 vector(double x) {
  proto::Vector3 message;
  message.set_x(x);
  return message;
}

TEST(ServerExtension, ReadsWhatItWrote) {
  proto::Vector3 read;
  WireBudget budget;
  read_extension(write_extension(vector(3)), "scene.extension", read, budget);
  EXPECT_EQ(read.x(), 3);
}

TEST(ServerExtension, RefusesMessagesOfAnotherType) {
  const auto refused = [](const google::protobuf::Any& extension) {
    proto::Array other;
    WireBudget budget;
    return refused_field([&] { read_extension(extension, "scene.extension", other, budget); });
  };
  EXPECT_EQ(refused(write_extension(vector(1))), "scene.extension");
  google::protobuf::Any nameless;
  EXPECT_EQ(refused(nameless), "scene.extension");
}

TEST(ServerExtension, ChecksBytesAsThoseOfRequests) {
  proto::Vector3 read;
  const auto refused = [&](const google::protobuf::Any& extension) {
    WireBudget budget;
    return refused_field([&] { read_extension(extension, "edits[2].extension", read, budget); });
  };
  EXPECT_EQ(refused(write_extension(vector(std::nan("")))), "edits[2].extension.x");
  auto twice = write_extension(vector(1));
  *twice.mutable_value() += twice.value();
  EXPECT_EQ(refused(twice), "edits[2].extension.x");
  auto unknown = write_extension(vector(1));
  *unknown.mutable_value() += "\xf8\x07\x01";
  EXPECT_EQ(refused(unknown), "edits[2].extension");
}

TEST(ServerExtension, AllOfARequestShareABudget) {
  proto::EditRequest edits;
  for (int i = 0; i < 10; ++i) edits.add_edits();
  const auto extension = write_extension(edits);
  WireBudget budget{25};
  proto::EditRequest read;
  read_extension(extension, "edits[0].extension", read, budget);
  read_extension(extension, "edits[1].extension", read, budget);
  try {
    read_extension(extension, "edits[2].extension", read, budget);
    FAIL() << "the third was taken";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
    EXPECT_EQ(refusal.field(), "edits[2].extension.edits[5]");
    EXPECT_EQ(refusal.details().at("limit"), "25");
  }
}

TEST(ServerExtension, IsAloneInItsScene) {
  proto::Scene scene;
  scene.set_name("chain");
  *scene.mutable_extension() = write_extension(vector(1));
  EXPECT_NO_THROW(demand_extension_alone(scene, "scene."));
  scene.set_frames(3);
  EXPECT_EQ(refused_field([&] { demand_extension_alone(scene, "scene."); }), "scene.frames");
}

}  // namespace
}  // namespace limber::server
