#include "server/service/session_registry.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/server/support/running_server.h"
#include "tests/server/wire/refused_field.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

/// A session of no kind: it is there, and its build may fail.
class PlainRecord final : public Record {
 public:
  PlainRecord(Hub& hub, const SessionKey& key)
      : Record(hub, key, "plain", hub.jobs.start("open", key.name, [] {})) {}
  void fail() { note_state(session::State::kFailed, "no such mesh"); }
  void try_again() { note_state(session::State::kBuilding, ""); }

  [[nodiscard]] const char* kind() const override { return "plain"; }
  [[nodiscard]] const char* subject() const override { return "nothing"; }
  [[nodiscard]] std::shared_ptr<const FrameSource> frames(bool) const override { return nullptr; }
  [[nodiscard]] proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest&) const override {
    return {};
  }
  [[nodiscard]] proto::EditResponse edit(const proto::EditRequest&,
                                         const session::Author&) override {
    return {};
  }
  void add_scene(const proto::GetSessionRequest&, proto::GetSessionResponse&) const override {}
  [[nodiscard]] proto::ExportResponse export_part(const proto::ExportRequest&) override {
    return {};
  }
  void stop_work() override {}
  void close_session() override {}

 private:
  void describe(proto::SessionStatus&) const override {}
  void adopt_model() override {}
  [[nodiscard]] bool is_attached() const override { return true; }
};

struct ServerSessionRegistry : ::testing::Test {
  Hub hub{test_options()};
  SessionRegistry sessions{3, hub.run, hub.session_ids};

  std::shared_ptr<PlainRecord> open(const std::string& name,
                                    std::vector<std::string>* gone = nullptr) {
    const auto place = sessions.reserve(name);
    auto record = std::make_shared<PlainRecord>(hub, place->key());
    for (const auto& other : sessions.put(record))
      if (gone != nullptr) gone->push_back(other->id());
    return record;
  }
  std::shared_ptr<PlainRecord> open_failed(const std::string& name) {
    auto record = open(name);
    record->fail();
    return record;
  }
  template <class Call>
  static proto::ErrorCode code_of(const Call& call) {
    try {
      call();
    } catch (const Refusal& refusal) {
      return refusal.code();
    }
    return proto::ERROR_CODE_UNSPECIFIED;
  }
  proto::ErrorCode code_of_reserving(const std::string& name) {
    return code_of([&] { (void)sessions.reserve(name); });
  }
  proto::ErrorCode code_of_finding(const std::string& reference) {
    return code_of([&] { (void)sessions.find(reference); });
  }
};

TEST_F(ServerSessionRegistry, NamesAreWhatFilesAndTopicsCanCarry) {
  for (const char* name : {"a", "A.b_c-9", "...", "-"})
    EXPECT_EQ(code_of_reserving(name), proto::ERROR_CODE_UNSPECIFIED) << name;
  EXPECT_EQ(code_of_reserving(std::string(64, 'x')), proto::ERROR_CODE_UNSPECIFIED);
  for (const std::string& name :
       {std::string(65, 'x'), std::string("."), std::string(".."), std::string("a/b"),
        std::string("a b"), std::string("a@1"), std::string("\xC3\xA4"), std::string("a\0", 2)}) {
    EXPECT_EQ(code_of_reserving(name), proto::ERROR_CODE_INVALID_ARGUMENT) << name;
    EXPECT_EQ(refused_field([&] { (void)sessions.reserve(name); }), "session");
  }
}

TEST_F(ServerSessionRegistry, AReservedNameIsTakenUntilItIsGivenBack) {
  {
    const auto place = sessions.reserve("cup");
    EXPECT_EQ(code_of_reserving("cup"), proto::ERROR_CODE_ALREADY_EXISTS);
    EXPECT_EQ(sessions.look_up("cup"), nullptr);
    EXPECT_EQ(code_of_finding("cup"), proto::ERROR_CODE_NOT_FOUND);
  }
  EXPECT_EQ(code_of_reserving("cup"), proto::ERROR_CODE_UNSPECIFIED);
  const auto record = open("cup");
  EXPECT_EQ(sessions.find("cup"), record);
  EXPECT_EQ(code_of_reserving("cup"), proto::ERROR_CODE_ALREADY_EXISTS);
}

TEST_F(ServerSessionRegistry, ReservedPlacesCountAsOpenSessions) {
  (void)open("one");
  const auto two = sessions.reserve("two");
  {
    const auto three = sessions.reserve("three");
    EXPECT_EQ(code_of_reserving("four"), proto::ERROR_CODE_LIMIT_EXCEEDED);
    EXPECT_EQ(code_of_reserving(""), proto::ERROR_CODE_LIMIT_EXCEEDED);
  }
  EXPECT_EQ(code_of_reserving("four"), proto::ERROR_CODE_UNSPECIFIED);
}

TEST_F(ServerSessionRegistry, ChosenNamesAreNewOnes) {
  const std::string first = sessions.reserve("")->key().name;
  const std::string second = sessions.reserve("")->key().name;
  EXPECT_NE(first, second);
  EXPECT_EQ(first.find("session-" + hub.run.instance.substr(0, 8) + "-"), 0u) << first;
  // The one that would come next is taken.
  const std::string third = first.substr(0, first.rfind('-')) + "-3";
  (void)open(third);
  EXPECT_NE(sessions.reserve("")->key().name, third);
}

TEST_F(ServerSessionRegistry, AUidReachesThisVerySession) {
  const auto first = open("cup");
  const std::string reference = first->key().reference();
  EXPECT_EQ(sessions.find(reference), first);
  sessions.remove(*first);
  EXPECT_EQ(code_of_finding("cup"), proto::ERROR_CODE_NOT_FOUND);
  const auto second = open("cup");
  EXPECT_EQ(sessions.find("cup"), second);
  EXPECT_EQ(code_of_finding(reference), proto::ERROR_CODE_NOT_FOUND);
  const std::uint64_t of_another_run = Run::begin().first_id + 1;
  EXPECT_EQ(code_of_finding("cup@" + std::to_string(of_another_run)), proto::ERROR_CODE_RESTARTED);
  EXPECT_EQ(code_of_finding("cup@x"), proto::ERROR_CODE_INVALID_ARGUMENT);
}

TEST_F(ServerSessionRegistry, WhatWasRemovedDoesNotTakeItsSuccessorAlong) {
  const auto first = open("cup");
  sessions.remove(*first);
  const auto second = open("cup");
  sessions.remove(*first);
  EXPECT_EQ(sessions.look_up("cup"), second);
  EXPECT_EQ(sessions.all().size(), 1u);
}

TEST_F(ServerSessionRegistry, AFailedOneGivesItsNameToTheNext) {
  const auto failed = open_failed("cup");
  EXPECT_EQ(sessions.find("cup"), failed);  // for whoever asks why
  std::vector<std::string> gone;
  const auto next = open("cup", &gone);
  EXPECT_EQ(gone, (std::vector<std::string>{"cup"}));
  EXPECT_EQ(sessions.find("cup"), next);
}

TEST_F(ServerSessionRegistry, FailedOnesTakeNoPlaceAndTheOldestGoesFirst) {
  (void)open_failed("z");
  (void)open_failed("a");
  (void)open("good");
  std::vector<std::string> gone;
  (void)open("new", &gone);
  EXPECT_EQ(gone, (std::vector<std::string>{"z"}));
  (void)open("newer", &gone);
  EXPECT_EQ(gone, (std::vector<std::string>{"z", "a"}));
  EXPECT_EQ(code_of_reserving("newest"), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

TEST_F(ServerSessionRegistry, AFailedOneThatIsTakenUpAgainKeepsItsPlace) {
  const auto failed = open_failed("cup");
  const auto place = sessions.reserve("cup");
  failed->try_again();
  const auto record = std::make_shared<PlainRecord>(hub, place->key());
  EXPECT_EQ(code_of([&] { (void)sessions.put(record); }), proto::ERROR_CODE_ALREADY_EXISTS);
  EXPECT_EQ(sessions.find("cup"), failed);
}

}  // namespace
}  // namespace limber::server
