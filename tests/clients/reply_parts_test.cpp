// Long answers that come in parts, as the client asks for them.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "tests/clients/fake_router.h"
#include "tests/clients/refusal.h"

namespace limber::client {
namespace {

constexpr std::size_t kBasisBytes = 1u << 20;

/// Of one limberd: a long geometry, in parts where they are asked for.
struct ReplyPartsOfClient : ::testing::Test {
  std::vector<std::string> answer(const v1::Request& request) {
    v1::Reply reply;
    reply.set_version(1);
    reply.set_id(request.id());
    reply.set_instance("run");
    asked.push_back(request);
    if (request.has_get_reply_part()) {
      answer_part(request.get_reply_part(), reply);
    } else if (is_older && request.most_reply_bytes() != 0) {
      reply.mutable_error()->set_code(v1::ERROR_CODE_INVALID_ARGUMENT);
      reply.mutable_error()->set_message("unknown field number 6 in Request; this server ...");
    } else {
      reply.mutable_get_geometry()->set_basis_hash("h");
      reply.mutable_get_geometry()->mutable_basis()->mutable_data()->assign(kBasisBytes, 'b');
      if (request.most_reply_bytes() != 0) {
        whole = reply.SerializeAsString();
        reply.clear_get_geometry();
        put_part(0, request.most_reply_bytes(), reply);
      }
    }
    return {reply.SerializeAsString()};
  }
  void answer_part(const v1::GetReplyPartRequest& wanted, v1::Reply& reply) {
    if (gone > 0) {
      --gone;
      reply.mutable_error()->set_code(v1::ERROR_CODE_FAILED_PRECONDITION);
      reply.mutable_error()->set_field("reply");
      return;
    }
    put_part(wanted.offset() + shifted, wanted.most_bytes(), reply);
  }
  void put_part(std::uint64_t offset, std::uint64_t most_bytes, v1::Reply& reply) const {
    auto& part = *reply.mutable_get_reply_part();
    part.set_reply(7);
    part.set_total_bytes(whole.size());
    part.set_offset(offset);
    part.set_data(whole.substr(offset, most_bytes));
  }
  v1::GetGeometryResponse fetch() {
    v1::GetGeometryRequest wanted;
    wanted.set_session("s");
    return client.call(wanted);
  }
  std::vector<v1::Request> asked;
  std::string whole;
  bool is_older = false;
  int gone = 0;  // so many parts are refused
  std::uint64_t shifted = 0;
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests()};
};

TEST_F(ReplyPartsOfClient, ArePutTogether) {
  const auto geometry = fetch();
  EXPECT_EQ(geometry.basis_hash(), "h");
  EXPECT_EQ(geometry.basis().data(), std::string(kBasisBytes, 'b'));
  ASSERT_GT(asked.size(), 3u);
  std::uint64_t at = asked[0].most_reply_bytes();
  for (std::size_t i = 1; i < asked.size(); ++i) {
    EXPECT_EQ(asked[i].get_reply_part().reply(), 7u);
    EXPECT_EQ(asked[i].get_reply_part().offset(), at);
    at += asked[i].get_reply_part().most_bytes();
  }
}

TEST_F(ReplyPartsOfClient, AreAskedForAnewWhereTheServerHasThemNoMore) {
  gone = 2;
  EXPECT_EQ(fetch().basis().data().size(), kBasisBytes);
  asked.clear();
  gone = 100;
  EXPECT_EQ(fetch().basis().data().size(), kBasisBytes);  // in one, in the end
  EXPECT_EQ(asked.size(), 7u);
}

TEST_F(ReplyPartsOfClient, AreNotAskedForOfAnOlderServerAgain) {
  is_older = true;
  EXPECT_EQ(fetch().basis().data().size(), kBasisBytes);
  EXPECT_EQ(asked.size(), 2u);
  EXPECT_EQ(fetch().basis().data().size(), kBasisBytes);
  EXPECT_EQ(asked.size(), 3u);
}

TEST_F(ReplyPartsOfClient, OfAServerThatLiesAreRefused) {
  shifted = 1;
  EXPECT_EQ(refusal([&] { (void)fetch(); }).code(), v1::ERROR_CODE_MALFORMED);
}

}  // namespace
}  // namespace limber::client
