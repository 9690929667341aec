#include "server/log/json_line.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace limber::server::log {
namespace {

nlohmann::json line(std::string_view message, Fields fields = {}) {
  return nlohmann::json::parse(
      json_line("2026-11-26T12:00:00.000Z", Level::kWarn, message, fields));
}

TEST(JsonLine, HasTimeLevelMessageAndFieldsThatAreNotEmpty) {
  const auto json = line("session s opened", {{"session", "s"}, {"error", ""}});
  EXPECT_EQ(json, (nlohmann::json{{"time", "2026-11-26T12:00:00.000Z"},
                                  {"level", "warn"},
                                  {"message", "session s opened"},
                                  {"session", "s"}}));
}

TEST(JsonLine, IsOneLineWhateverAClientSent) {
  const std::string text = "a\"b\\c\nd\te\r\x01\x7f";
  const std::string whole = json_line("t", Level::kInfo, text, {{"field", text}});
  EXPECT_EQ(whole.find('\n'), std::string::npos);
  const auto json = nlohmann::json::parse(whole);
  EXPECT_EQ(json.at("message"), text);
  EXPECT_EQ(json.at("field"), text);
}

TEST(JsonLine, WhatIsNotUtf8IsReplaced) {
  EXPECT_EQ(line("\xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80").at("message"),
            "\xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80");
  const std::string replaced = "\xef\xbf\xbd";
  // Cut off, too long a form, half of a pair, beyond U+10FFFF, a byte without its first.
  for (const char* bytes : {"\xc3", "\xe2\x82", "\xf5", "\xff", "\x80"}) {
    const std::string message = line("x" + std::string(bytes)).at("message");
    EXPECT_EQ(message.substr(0, 4), "x" + replaced) << bytes;
  }
  for (const char* bytes : {"\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"})
    EXPECT_EQ(std::string(line(bytes).at("message")).substr(0, 3), replaced) << bytes;
}

}  // namespace
}  // namespace limber::server::log
