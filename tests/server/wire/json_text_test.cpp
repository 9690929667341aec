#include "proto/json_text.h"

#include <gtest/gtest.h>

#include "limber/v1/service.pb.h"

namespace limber::json {
namespace {

std::optional<Fault> fault_of(std::string_view text) {
  v1::Scene scene;
  return read_message(text, scene);
}

TEST(JsonText, AKeyGivenTwiceIsNamedByItsPath) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"frames": 30, "frames": 40})", "frames"},
      {R"({"fixed_nodes": [1], "fixedNodes": [2]})", "fixedNodes"},
      {R"({"material": {"density": 1, "density": 2}})", "material.density"},
      {R"({"constraints": [{"frame": 1}, {"frame": 1, "nodes": [1, 2], "frame": 2}]})",
       "constraints[1].frame"},
      {R"({"mesh": {"file": {"companions": {"a_b.node": "", "a_b.node": ""}}}})",
       "mesh.file.companions.a_b.node"},
      {R"({"name": "a\"}, {\"", "name": "b"})", "name"},
      {R"({frames: 30, 'frames': 40})", "frames"}};
  for (const auto& [text, field] : cases) {
    const auto fault = fault_of(text);
    ASSERT_TRUE(fault) << text;
    EXPECT_EQ(fault->field, field);
    EXPECT_EQ(fault->message, "given twice");
  }
}

TEST(JsonText, TheSameKeyInDifferentObjectsIsFine) {
  for (const char* text :
       {R"({"constraints": [{"frame": 1}, {"frame": 1}], "frames": 3, "name": "name"})",
        R"({"material_groups": [{"material": {"density": 1}}, {"material": {"density": 1}}]})",
        R"({"mesh": {"file": {"companions": {"a_b.node": "", "aB.node": ""}}}})",
        R"({"name": "{"})", R"({"name": "\"frames\": 1, \"frames\": 2"})", "{}",
        R"({"mesh": {}, "constraints": [{}, []]})"}) {
    const auto fault = fault_of(text);
    EXPECT_TRUE(!fault || fault->message != "given twice") << text;
  }
  v1::Scene scene;
  EXPECT_FALSE(read_message(R"( {"frames" : 30 ,"name":"x"} )", scene));
  EXPECT_EQ(scene.frames(), 30u);
  EXPECT_EQ(scene.name(), "x");
}

TEST(JsonText, ErrorsOfProtobufNameTheField) {
  struct Case {
    const char *text, *field, *message;
  };
  for (const auto& [text, field, message] :
       {Case{"[]", "", "a JSON object is expected: {...}"},
        Case{"3", "", "a JSON object is expected: {...}"},
        Case{R"({"frames": 1.5})", "frames", "invalid value 1.5, a whole number >= 0 is expected"},
        Case{R"({"constraints": [{"frame": "x"}]})", "constraints[0].frame",
             "invalid value \"x\", a whole number >= 0 is expected"},
        Case{R"({"material": {"density": "x"}})", "material.density",
             "invalid value \"x\", a number is expected"},
        Case{R"({"first_end": "X"})", "first_end", "invalid value \"X\", which is no EndCondition"},
        Case{R"({"fram": 3})", "fram", "there is no such field: did you mean frames?"},
        Case{R"({"linkage": {"sektion": {}}})", "linkage.sektion",
             "there is no such field: did you mean section?"},
        Case{R"({"quite_another": 1})", "quite_another", "there is no such field"},
        Case{R"({"linkage": {"conditions": {"angles": [{"joint": 2, "angle": 3}]}}})",
             "linkage.conditions.angles[0].angle", "there is no such field"}}) {
    const auto fault = fault_of(text);
    ASSERT_TRUE(fault) << text;
    EXPECT_EQ(fault->field, field);
    EXPECT_EQ(fault->message, message);
  }
}

TEST(JsonText, AByteOrderMarkIsSkipped) { EXPECT_FALSE(fault_of("\xEF\xBB\xBF{\"frames\": 3}")); }

TEST(JsonText, BrokenTextIsOneSentenceOnOneLine) {
  for (const char* text :
       {"", "{", "{\"a\"", "{\"frames\": 3,\n\n  nonsense", "{\"name\": \"\xff\"}", "[[[[[[[[[[",
        "{\"name\": \"", "\\", "{,,}", "{:1,:1}", "{]", "{\"a\":\\}"}) {
    const auto fault = fault_of(text);
    ASSERT_TRUE(fault) << text;
    EXPECT_EQ(fault->message.find('\n'), std::string::npos) << fault->message;
    EXPECT_FALSE(fault->message.empty());
    EXPECT_FALSE(fault->message.starts_with(':')) << fault->message;
  }
}

TEST(JsonText, ACommaThatNothingFollowsIsRefusedAtItsPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"frames": 100,})", "line 1 column 15"},
      {"{\"fixed_nodes\": [1,\n 2 , ], \"frames\": 3}", "line 2 column 4"},
      {"{\"name\": \",}\",\n}", "line 1 column 14"}};
  for (const auto& [text, place] : cases) {
    const auto fault = fault_of(text);
    ASSERT_TRUE(fault) << text;
    EXPECT_EQ(fault->message, std::string("not JSON: nothing follows the comma at ") + place);
  }
  EXPECT_FALSE(fault_of(R"({"name": ",}", "fixed_nodes": [1, 2]})"));
}

TEST(JsonText, NestingWithoutEndIsRefused) {
  for (const char* opening : {"[", "{\"a\":"}) {
    std::string text;
    for (int i = 0; i < 1000000; ++i) text += opening;
    EXPECT_TRUE(fault_of(text));
  }
}

}  // namespace
}  // namespace limber::json
