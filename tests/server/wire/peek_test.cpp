#include "server/wire/peek.h"

#include <gtest/gtest.h>

#include "tests/server/support/client.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

TEST(PeekRequest, ReadsIdVersionAndBody) {
  proto::Request request = wait_request("a", 1);
  request.set_version(7);
  request.set_id(1ull << 60);
  const RequestPeek peek = peek_request(request.SerializeAsString());
  EXPECT_EQ(peek.version, 7u);
  EXPECT_EQ(peek.id, 1ull << 60);
  EXPECT_EQ(peek.body, proto::Request::kWait);
  EXPECT_TRUE(peek.fault.empty());
}

TEST(PeekRequest, KeepsTheIdOfWhatIsDamagedLater) {
  proto::Request request = wait_request("a", 1);
  request.set_id(5);
  std::string bytes = request.SerializeAsString();
  bytes.resize(bytes.size() - 1);
  const RequestPeek peek = peek_request(bytes);
  EXPECT_EQ(peek.id, 5u);
  EXPECT_FALSE(peek.fault.empty());
  EXPECT_FALSE(peek_request("").fault.empty());
  EXPECT_FALSE(peek_request("GET / HTTP/1.1\r\n\r\n").fault.empty());
}

TEST(PeekRequest, DoesNotWalkWhatIsLongerThanARequest) {
  std::string bytes = info_request().SerializeAsString();
  for (int i = 0; i < 20; ++i) bytes += std::string("\x18\x01", 2);  // field 3, of which is none
  bytes += "\x07";                                                   // no wire type at all
  const RequestPeek peek = peek_request(bytes);
  EXPECT_TRUE(peek.fault.empty()) << "read to the end: " << peek.fault;
  EXPECT_EQ(peek.body, proto::Request::kGetServerInfo);
  // A group that never ends, behind the envelope.
  const std::string group = std::string("\x08\x01\x10\x05", 4) + std::string(1000, '\x33');
  EXPECT_EQ(peek_request(group).id, 5u);
  EXPECT_TRUE(peek_request(group).fault.empty());
}

TEST(PeekSession, IsNamedByAnyBodyThatHasOne) {
  const auto peeked = [](const proto::Request& request) {
    const std::string bytes = request.SerializeAsString();
    return peek_session(bytes, peek_request(bytes).body);
  };
  EXPECT_EQ(peeked(wait_request("arm", 1)), "arm");
  EXPECT_EQ(peeked(wait_request("arm@123", 1)), "arm") << "with its uid it is the same session";
  EXPECT_EQ(peeked(info_request()), "");
  proto::Request request;
  request.set_version(1);
  for (int i = 0; i < 3000; ++i) request.mutable_edit()->add_edits()->mutable_undo();
  EXPECT_EQ(peeked(request), "");
  request.mutable_edit()->set_session("s");
  EXPECT_EQ(peeked(request), "s");
  // Behind the edits, where another writer may put it.
  proto::Request late;
  late.set_version(1);
  for (int i = 0; i < 3000; ++i) late.mutable_edit()->add_edits()->mutable_undo();
  std::string edit = late.edit().SerializeAsString();
  edit += std::string("\x0a\x01t", 3);
  late.clear_edit();
  std::string bytes = late.SerializeAsString();
  bytes += static_cast<char>(0x80 | ((proto::Request::kEdit << 3 | 2) & 0x7f));
  bytes += static_cast<char>(proto::Request::kEdit << 3 >> 7);
  bytes += static_cast<char>(0x80 | (edit.size() & 0x7f));
  bytes += static_cast<char>(edit.size() >> 7);
  bytes += edit;
  EXPECT_EQ(peek_session(bytes, proto::Request::kEdit), "t");
  for (std::size_t cut = 0; cut < bytes.size(); cut += 7)
    EXPECT_EQ(peek_session(bytes.substr(0, cut), proto::Request::kEdit), "");
  EXPECT_EQ(peek_session("GET / HTTP/1.1", 12), "");
}

}  // namespace
}  // namespace limber::server
