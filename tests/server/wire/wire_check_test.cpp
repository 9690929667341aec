#include "server/wire/wire_check.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/server/support/client.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using namespace limber::server::testing;

const google::protobuf::Descriptor& request_type() { return *proto::Request::descriptor(); }

Refusal refusal_of(const std::string& bytes, const WireLimits& limits = {}) {
  try {
    check_wire(bytes, request_type(), limits);
  } catch (const Refusal& refusal) {
    return refusal;
  }
  ADD_FAILURE() << "was accepted";
  return invalid("", "");
}

proto::Request edit_with_two() {
  proto::Request request = move_request("a", 1, 1, 2, 3);
  auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  constraint->mutable_position()->set_x(1);
  constraint->add_axes(proto::AXIS_X);
  constraint->add_axes(proto::AXIS_Z);
  return request;
}

TEST(WireCheck, AcceptsWhatProtobufWrites) {
  EXPECT_NO_THROW(check_wire(edit_with_two().SerializeAsString(), request_type()));
  EXPECT_NO_THROW(check_wire(open_request(small_scene()).SerializeAsString(), request_type()));
  EXPECT_NO_THROW(check_wire("", request_type()));
}

TEST(WireCheck, UnknownFieldsAreNamedByTheMessageTheyAreIn) {
  proto::Request request = edit_with_two();
  auto* constraint = request.mutable_edit()->mutable_edits(1)->mutable_add()->mutable_constraint();
  constraint->GetReflection()->MutableUnknownFields(constraint)->AddVarint(77, 1);
  const Refusal refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(refusal.field(), "edits[1].add.constraint");
  EXPECT_THAT(refusal.what(), HasSubstr("unknown field number 77 in Constraint"));
}

TEST(WireCheck, UnknownFieldsOfTheOutermostMessage) {
  proto::Request request = info_request();
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(4000, "x");
  EXPECT_THAT(refusal_of(request.SerializeAsString()).what(),
              HasSubstr("unknown field number 4000 in Request"));
}

TEST(WireCheck, NumbersThatAreNotFinite) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    const Refusal refusal = refusal_of(move_request("a", 1, 0, bad, 0).SerializeAsString());
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(refusal.field(), "edits[0].move.target.y");
  }
}

TEST(WireCheck, EnumValuesNobodyDefined) {
  proto::Request request = edit_with_two();
  request.mutable_edit()->mutable_edits(1)->mutable_add()->mutable_constraint()->set_axes(
      1, static_cast<proto::Axis>(9));
  Refusal refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.field(), "edits[1].add.constraint.axes[1]");
  EXPECT_THAT(refusal.what(), HasSubstr("9 is no value of Axis"));
  request = wait_request("a", 1);
  request.mutable_wait()->set_until(static_cast<proto::WaitRequest::Until>(-3));
  refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.field(), "until");
}

TEST(WireCheck, SingularFieldsGivenTwice) {
  const std::string once = info_request().SerializeAsString();
  EXPECT_THAT(refusal_of(once + once).what(), HasSubstr("given twice"));
  const std::string other = wait_request("a", 1).SerializeAsString();
  EXPECT_EQ(refusal_of(once + other).field(), "wait");
  EXPECT_THAT(refusal_of(once + other).what(),
              HasSubstr("given beside get_server_info, only one of body"));
}

TEST(WireCheck, WrongWireTypes) {
  // Request.version (1) as length-delimited, Request.edit (15) as a varint.
  EXPECT_EQ(refusal_of(std::string("\x0a\x01x", 3)).field(), "version");
  EXPECT_EQ(refusal_of(std::string("\x78\x01", 2)).field(), "edit");
}

TEST(WireCheck, EveryTruncationIsRefused) {
  const std::string bytes = edit_with_two().SerializeAsString();
  // Cut at field boundaries of the outermost message, what is left is a message; nowhere else.
  int accepted = 0;
  for (std::size_t length = 1; length < bytes.size(); ++length) {
    try {
      check_wire(bytes.substr(0, length), request_type());
      ++accepted;
    } catch (const Refusal& refusal) {
      EXPECT_EQ(refusal.code(), proto::ERROR_CODE_MALFORMED) << length;
    }
  }
  EXPECT_EQ(accepted, 0);  // there is one field only
}

TEST(WireCheck, LengthsBeyondTheEndAndBeyondTheParent) {
  EXPECT_EQ(refusal_of(std::string("\x7a\xff\xff\xff\xff\x07", 6)).code(),
            proto::ERROR_CODE_MALFORMED);
  EXPECT_EQ(refusal_of(std::string("\x7a\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01", 11)).code(),
            proto::ERROR_CODE_MALFORMED);
  // edit { session: length 5 of which 1 is inside } and four more bytes after the parent.
  EXPECT_EQ(refusal_of(std::string("\x7a\x03\x0a\x05x\x08\x01\x08\x01", 9)).code(),
            proto::ERROR_CODE_MALFORMED);
}

TEST(WireCheck, SubmessagesAreCountedBeforeTheyAreBuilt) {
  proto::Request request;
  for (int i = 0; i < 1000; ++i) request.mutable_edit()->add_edits();
  const Refusal refusal = refusal_of(request.SerializeAsString(), {500});
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(refusal.details().at("limit"), "500");
}

TEST(WireCheck, GroupsAndFieldZeroAreMalformedOrUnknown) {
  for (const char* bytes : {"\x7b\x7c", "\x7c", "\x03", "\x00\x01"}) {
    EXPECT_THROW(check_wire(std::string(bytes, 2), request_type()), Refusal);
  }
}

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
  const std::string group = std::string("\x08\x01\x10\x05", 4) + std::string(1000, '\x2b');
  EXPECT_EQ(peek_request(group).id, 5u);
  EXPECT_TRUE(peek_request(group).fault.empty());
  EXPECT_THAT(refusal_of(group).what(), HasSubstr("unknown field number 5"));
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
