#include "server/kinds/kind.h"

#include <gmock/gmock.h>

#include "server/kinds/registry.h"
#include "server/wire/extension.h"

namespace limber::server {
namespace {

/// Takes scenes of one name.
class NamedKind final : public Kind {
 public:
  NamedKind(const char* name, const char* sample) : name_(name), sample_(sample) {}

  [[nodiscard]] const char* name() const override { return name_; }
  [[nodiscard]] bool accepts(const proto::Scene& scene) const override {
    return scene.name() == "any" || scene.name() == name_;
  }
  [[nodiscard]] std::unique_ptr<Opening> read(const proto::Scene&,
                                              const SceneContext&) const override {
    return nullptr;
  }
  [[nodiscard]] std::vector<proto::Issue> validate(const proto::Scene&, const std::string&,
                                                   const SceneContext&) const override {
    return {};
  }
  [[nodiscard]] std::vector<std::string> sample_names() const override { return {sample_}; }
  [[nodiscard]] proto::Scene sample(const std::string& name) const override { return named(name); }
  static proto::Scene named(const std::string& name) {
    proto::Scene scene;
    scene.set_name(name);
    return scene;
  }

 private:
  const char* name_;
  const char* sample_;
};

Kinds two_kinds() {
  Kinds kinds;
  kinds.add(std::make_unique<NamedKind>("first", "one"));
  kinds.add(std::make_unique<NamedKind>("second", "two"));
  return kinds;
}

TEST(ServerKinds, TheFirstThatAcceptsASceneHasIt) {
  const Kinds kinds = two_kinds();
  EXPECT_STREQ(kinds.of(NamedKind::named("second"), "scene").name(), "second");
  EXPECT_STREQ(kinds.of(NamedKind::named("any"), "scene").name(), "first");
  try {
    (void)kinds.of(NamedKind::named("third"), "scene");
    ADD_FAILURE() << "accepted";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_UNSUPPORTED);
    EXPECT_EQ(refusal.field(), "scene");
    EXPECT_THAT(refusal.what(), ::testing::HasSubstr("first, second"));
  }
}

TEST(ServerKinds, SamplesAreThoseOfAllKinds) {
  const Kinds kinds = two_kinds();
  EXPECT_THAT(kinds.sample_names(), ::testing::ElementsAre("one", "two"));
  EXPECT_EQ(kinds.sample("two").name(), "two");
  try {
    (void)kinds.sample("three");
    ADD_FAILURE() << "found";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_EQ(error.field(), "name");
    EXPECT_THAT(error.what(), ::testing::HasSubstr("there are one, two"));
  }
}

TEST(ServerKinds, EditsWithFilesAreHeavyAndPosesMayBeLarge) {
  const Kinds kinds = standard_kinds({});
  const auto request_with = [](auto fill) {
    proto::EditRequest request;
    request.add_edits()->mutable_undo();
    fill(*request.add_edits());
    return request;
  };
  const auto array = request_with(
      [](auto& edit) { edit.mutable_add_keyframe()->mutable_keyframe()->mutable_positions(); });
  const auto file = request_with(
      [](auto& edit) { edit.mutable_add_keyframe()->mutable_keyframe()->mutable_file(); });
  const auto path = request_with(
      [](auto& edit) { edit.mutable_add_keyframe()->mutable_keyframe()->set_path("pose.vtu"); });
  const auto move = request_with([](auto& edit) { edit.mutable_move_keyframe(); });
  EXPECT_FALSE(kinds.are_heavy(array));
  EXPECT_TRUE(kinds.are_heavy(file));
  EXPECT_TRUE(kinds.are_heavy(path));
  EXPECT_FALSE(kinds.are_heavy(move));
  EXPECT_TRUE(kinds.may_be_large(array));
  EXPECT_TRUE(kinds.may_be_large(file));
  EXPECT_TRUE(kinds.may_be_large(path));
  EXPECT_FALSE(kinds.may_be_large(move));
}

TEST(ServerKinds, StandardKindsReadTheirOwnScenes) {
  const Kinds kinds = standard_kinds({});
  for (const auto& [name, kind] :
       {std::pair{"beam", "bodies"}, {"hyperboloid", "linkages"}, {"arch", "beams"}}) {
    const proto::Scene scene = kinds.sample(name);
    EXPECT_STREQ(kinds.of(scene, "scene").name(), kind);
  }
  proto::Scene scene = kinds.sample("beam");
  *scene.mutable_extension() = write_extension(proto::Vector3());
  EXPECT_THROW((void)kinds.of(scene, "scene"), Refusal) << "no body has an extension";
}

}  // namespace
}  // namespace limber::server
