#include "server/web/door.h"

#include <gtest/gtest.h>

#include "server/web/headers.h"

namespace limber::server::web {
namespace {

const std::string kToken = "0123456789abcdef0123456789abcdef";

/// What a browser sends that opens the socket of requests.
Visit opening() {
  static const std::string target = "/v1/requests?token=" + kToken;
  Visit visit;
  visit.method = "GET";
  visit.target = target;
  visit.host = "127.0.0.1:8080";
  visit.origin = "http://127.0.0.1:8080";
  visit.is_upgrade = true;
  visit.local_address = "127.0.0.1";
  return visit;
}

Visit reading(std::string_view target) {
  Visit visit = opening();
  visit.target = target;
  visit.origin = {};
  visit.is_upgrade = false;
  return visit;
}

Verdict judge(const Visit& visit, std::vector<std::string> hosts = {}) {
  return Door(kToken, std::move(hosts)).judge(visit);
}

TEST(Door, OwnPagesComeInWithTheToken) {
  EXPECT_EQ(judge(opening()).way, Verdict::Way::kRequests);
  Visit stream = opening();
  const std::string target = "/v1/stream?a=b&token=" + kToken;
  stream.target = target;
  EXPECT_EQ(judge(stream).way, Verdict::Way::kStream);
  Visit program = opening();  // no browser: it has no origin
  program.origin = {};
  EXPECT_EQ(judge(program).way, Verdict::Way::kRequests);
}

TEST(Door, WithoutTheTokenNobodyDoes) {
  for (const std::string& query : std::vector<std::string>{
           "", "?", "?token", "?token=", "?token=0", "?tokens=" + kToken, "?token=" + kToken + "0",
           "?token=" + kToken.substr(1), "?token=" + kToken + kToken,
           "?token=" + kToken.substr(0, 31) + "0"}) {
    for (const std::string path : {"/v1/requests", "/v1/stream"}) {
      Visit visit = opening();
      const std::string target = path + query;
      visit.target = target;
      EXPECT_EQ(judge(visit).status, 401u) << target;
      visit.is_upgrade = false;
      EXPECT_EQ(judge(visit).status, 401u) << target;
    }
  }
}

TEST(Door, ARightTokenCanBeToldFromAWrongOne) {
  Visit visit = opening();
  visit.is_upgrade = false;
  EXPECT_EQ(judge(visit).status, 426u);
}

TEST(Door, OtherOriginsAreRefused) {
  for (const std::string_view origin :
       {"http://127.0.0.1", "http://127.0.0.1:80801", "http://localhost:8080",
        "http://evil.example", "http://127.0.0.1:8080.evil.example", "null", "file://",
        "ftp://127.0.0.1:8080", "http://evil@127.0.0.1:8080", " http://127.0.0.1:8080"}) {
    Visit visit = opening();
    visit.origin = origin;
    EXPECT_EQ(judge(visit).status, 403u) << origin;
    visit.target = "/";
    visit.is_upgrade = false;
    EXPECT_EQ(judge(visit).status, 403u) << origin;
  }
  Visit twice = opening();
  twice.origin = {};
  twice.has_many_origins = true;
  EXPECT_EQ(judge(twice).status, 403u);
}

TEST(Door, OfHostsOnlyAddressesOfThisServerAreTaken) {
  for (const std::string_view host :
       {"localhost", "LOCALHOST:9000", "127.0.0.1", "127.8.9.10:1", "[::1]", "[::1]:8080"}) {
    Visit visit = reading("/");
    visit.host = host;
    EXPECT_EQ(judge(visit).way, Verdict::Way::kFile) << host;
  }
  for (const std::string_view host : {"",
                                      "evil.example",
                                      "localhost.evil.example",
                                      "127.0.0.1.evil.example:8080",
                                      "192.168.0.1:8080",
                                      "[::2]:8080",
                                      "[::1]evil",
                                      "::1",
                                      "0x7f.1",
                                      "127.1",
                                      "localhost\r\nX: y",
                                      "[::1",
                                      "2130706433",
                                      "localhost:; frame-ancestors *",
                                      "localhost:8080; frame-ancestors *",
                                      "[::1]:; frame-ancestors *",
                                      "127.0.0.1:80 *",
                                      "localhost:",
                                      "localhost:-1",
                                      "localhost:80:80"}) {
    Visit visit = reading("/");
    visit.host = host;
    EXPECT_EQ(judge(visit).status, 403u) << host;
  }
}

TEST(Door, TheAddressThatWasReachedAndGivenNamesAreOwnHosts) {
  Visit visit = reading("/");
  visit.host = "192.168.0.7:8080";
  visit.local_address = "192.168.0.7";
  EXPECT_EQ(judge(visit).way, Verdict::Way::kFile);
  visit.host = "Limber.Example";
  EXPECT_EQ(judge(visit).status, 403u);
  EXPECT_EQ(judge(visit, {"limber.example"}).way, Verdict::Way::kFile);
  visit.origin = "https://limber.example";  // of a proxy
  EXPECT_EQ(judge(visit, {"limber.example"}).way, Verdict::Way::kFile);
}

TEST(Door, FilesAreOnlyRead) {
  EXPECT_EQ(judge(reading("/a/b.js?v=1")).path, "/a/b.js");
  Visit visit = reading("/");
  visit.method = "HEAD";
  EXPECT_EQ(judge(visit).way, Verdict::Way::kFile);
  for (const std::string_view method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "BREW"}) {
    visit.method = method;
    EXPECT_EQ(judge(visit).status, 405u) << method;
  }
  EXPECT_EQ(judge(reading("http://127.0.0.1:8080/")).status, 400u);
  EXPECT_EQ(judge(reading("*")).status, 400u);
  Visit socket = opening();
  socket.target = "/v2/requests";
  EXPECT_EQ(judge(socket).status, 404u);
}

TEST(Door, ParametersAreFoundByTheirWholeNames) {
  EXPECT_EQ(query_value("/?a=1&b=2", "b"), "2");
  EXPECT_EQ(query_value("/?ab=1&b=2", "b"), "2");
  EXPECT_EQ(query_value("/?b=&b=2", "b"), "");
  EXPECT_EQ(query_value("/?b", "b"), "");
  EXPECT_EQ(query_value("/b=2", "b"), "");
  EXPECT_EQ(query_value("/?a?b=1&&b=x=y", "b"), "x=y");
}

TEST(Headers, NameTheHostForSocketsAndWhoMayEmbed) {
  const auto policy = [](const auto& headers) { return headers.front().second; };
  const auto own = security_headers("127.0.0.1:8080", {});
  EXPECT_EQ(own.front().first, "Content-Security-Policy");
  EXPECT_NE(policy(own).find("connect-src 'self' ws://127.0.0.1:8080 wss://127.0.0.1:8080;"),
            std::string::npos);
  EXPECT_TRUE(policy(own).ends_with("frame-ancestors 'self'"));
  EXPECT_EQ(policy(own).find("unsafe"), std::string::npos);
  EXPECT_NE(policy(security_headers("", {})).find("connect-src 'self';"), std::string::npos);
  EXPECT_TRUE(policy(security_headers("", {"http://localhost:8888", "https://hub.example"}))
                  .ends_with("frame-ancestors 'self' http://localhost:8888 https://hub.example"));
}

}  // namespace
}  // namespace limber::server::web
