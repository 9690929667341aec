#include "server/transport/stream_queue.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

using Keep = TopicSlots::Keep;
using Put = StreamQueue::Put;
using Strings = std::vector<std::string>;

SharedMessages messages(std::vector<StreamBytes> all) {
  return std::make_shared<const std::vector<StreamBytes>>(std::move(all));
}

/// So many bytes with all that they cost.
std::string of_cost(std::uint64_t cost, char letter) {
  return std::string(cost - StreamQueue::kMessageBytes, letter);
}

Strings take_all(StreamQueue& queue) {
  Strings all;
  while (auto message = queue.take())
    all.push_back(message->topic + ":" + message->bytes->substr(0, 4));
  return all;
}

TEST(StreamQueue, SendsWhatComesInOrder) {
  StreamQueue queue(1 << 20);
  queue.put("a", messages({"1", "2"}), Keep::kNewest);
  EXPECT_EQ(take_all(queue), (Strings{"a:1", "a:2"}));
  queue.put("a", messages({"3"}), Keep::kNewest);
  EXPECT_EQ(take_all(queue), Strings{"a:3"});
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(StreamQueue, APageThatSleepsFindsTheNewestOfEachTopic) {
  StreamQueue queue(1 << 20);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(queue.put("frames", messages({std::to_string(i), "end"}), Keep::kNewest),
              Put::kTaken);
    EXPECT_EQ(queue.put("status", messages({std::to_string(i)}), Keep::kNewest), Put::kTaken);
    EXPECT_LE(queue.bytes(), 3 * (StreamQueue::kMessageBytes + 4));
  }
  EXPECT_EQ(take_all(queue), (Strings{"frames:999", "status:999", "frames:end"}));
  EXPECT_EQ(queue.given_up(), 3u * 999);
}

TEST(StreamQueue, APublicationThatIsHalfSentGivesWayToTheNextOne) {
  StreamQueue queue(1 << 20);
  queue.put("a", messages({"1", "2", "3"}), Keep::kNewest);
  EXPECT_EQ(*queue.take()->bytes, "1");
  queue.put("a", messages({"4", "5"}), Keep::kNewest);
  EXPECT_EQ(take_all(queue), (Strings{"a:4", "a:5"}));
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(StreamQueue, TopicsTakeTurns) {
  StreamQueue queue(1 << 20);
  queue.put("long", messages({"1", "2", "3"}), Keep::kOrder);
  queue.put("short", messages({"x"}), Keep::kNewest);
  EXPECT_EQ(take_all(queue), (Strings{"long:1", "short:x", "long:2", "long:3"}));
}

TEST(StreamQueue, MessagesInOrderStayOrOverflow) {
  StreamQueue queue(3000);
  for (const char letter : {'0', '1', '2', '3'})  // the first does not count
    EXPECT_EQ(queue.put("changes", messages({of_cost(1000, letter)}), Keep::kOrder), Put::kTaken);
  EXPECT_EQ(queue.put("changes", messages({of_cost(300, '4')}), Keep::kOrder), Put::kOverflow);
  EXPECT_EQ(queue.bytes(), 4000u);
  EXPECT_EQ(queue.take()->bytes->front(), '0');
  EXPECT_EQ(queue.put("other", messages({of_cost(1000, '5')}), Keep::kOrder), Put::kOverflow);
  EXPECT_EQ(queue.take()->bytes->front(), '1');
  EXPECT_EQ(queue.put("other", messages({of_cost(1000, '5')}), Keep::kOrder), Put::kTaken);
  EXPECT_EQ(queue.put("other", messages({of_cost(1000, '6')}), Keep::kOrder), Put::kOverflow);
  EXPECT_EQ(take_all(queue), (Strings{"changes:2222", "other:5555", "changes:3333"}));
  EXPECT_EQ(queue.put("changes", messages({of_cost(3000, '7')}), Keep::kOrder), Put::kTaken);
}

TEST(StreamQueue, APublicationInOrderBeforeWhichNoneWaitsMayBeLargerThanTheLimit) {
  StreamQueue queue(3000);
  const auto large = messages({of_cost(9000, '1'), of_cost(9000, '2')});
  EXPECT_EQ(queue.put("changes", large, Keep::kOrder), Put::kTaken);
  EXPECT_EQ(queue.put("changes", messages({of_cost(3000, '3')}), Keep::kOrder), Put::kTaken);
  EXPECT_EQ(queue.put("changes", large, Keep::kOrder), Put::kOverflow);
  EXPECT_EQ(queue.put("status", messages({of_cost(300, 's')}), Keep::kNewest), Put::kTaken);
  EXPECT_EQ(take_all(queue),
            (Strings{"changes:1111", "status:ssss", "changes:2222", "changes:3333"}));
  EXPECT_EQ(queue.bytes(), 0u);
  EXPECT_EQ(queue.put("changes", large, Keep::kOrder), Put::kTaken);
}

TEST(StreamQueue, WhatBeginsATopicTakesThePlaceOfWhatWaits) {
  StreamQueue queue(3000);
  const auto whole = messages({of_cost(9000, 'w'), of_cost(9000, 'W')});
  for (int i = 0; i < 3; ++i) {  // pages that join: each is welcomed with the whole motion
    EXPECT_EQ(queue.put("changes", whole, Keep::kBegin), Put::kTaken);
    EXPECT_EQ(queue.put("changes", messages({of_cost(2000, 'a')}), Keep::kOrder), Put::kTaken);
    EXPECT_EQ(queue.put("changes", messages({of_cost(2000, 'b')}), Keep::kOrder), Put::kTaken);
  }
  EXPECT_EQ(queue.bytes(), 22'000u);
  EXPECT_EQ(queue.given_up(), 2u * 4);
  EXPECT_EQ(queue.put("other", whole, Keep::kBegin), Put::kTaken);
  EXPECT_EQ(queue.put("status", messages({of_cost(300, 's')}), Keep::kNewest), Put::kTaken);
  EXPECT_EQ(take_all(queue), (Strings{"changes:wwww", "other:wwww", "status:ssss", "changes:WWWW",
                                      "other:WWWW", "changes:aaaa", "changes:bbbb"}));
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(StreamQueue, FramesGiveWayToWhatIsNewer) {
  StreamQueue queue(3000);
  queue.put("a", messages({of_cost(1000, 'a')}), Keep::kNewest);
  queue.put("b", messages({of_cost(1000, 'b')}), Keep::kNewest);
  queue.put("changes", messages({of_cost(300, '0')}), Keep::kOrder);  // does not count
  queue.put("changes", messages({of_cost(1500, 'c')}), Keep::kOrder);
  EXPECT_EQ(queue.bytes(), 3800u);  // the largest of a and b does not count
  queue.put("d", messages({of_cost(1200, 'd')}), Keep::kNewest);
  EXPECT_EQ(queue.bytes(), 4000u);
  EXPECT_EQ(queue.given_up(), 1u);
  EXPECT_EQ(take_all(queue), (Strings{"b:bbbb", "changes:0000", "d:dddd", "changes:cccc"}));
}

TEST(StreamQueue, OnePublicationOfFramesMayBeLargerThanTheLimit) {
  StreamQueue queue(3000);
  queue.put("changes", messages({of_cost(300, '0')}), Keep::kOrder);  // does not count
  queue.put("changes", messages({of_cost(2000, 'c')}), Keep::kOrder);
  queue.put("a", messages({of_cost(2000, 'a')}), Keep::kNewest);
  EXPECT_EQ(queue.put("b", messages({of_cost(9000, 'b'), of_cost(9000, 'B')}), Keep::kNewest),
            Put::kTaken);
  EXPECT_EQ(queue.bytes(), 20'300u);
  EXPECT_EQ(queue.put("b", messages({of_cost(9000, 'n')}), Keep::kNewest), Put::kTaken);
  EXPECT_EQ(queue.bytes(), 11'300u);
  queue.put("status", messages({of_cost(300, 's')}), Keep::kNewest);
  EXPECT_EQ(queue.bytes(), 11'600u);  // small ones do not drive it out
  queue.put("e", messages({of_cost(5000, 'e')}), Keep::kNewest);
  EXPECT_EQ(take_all(queue), (Strings{"changes:0000", "e:eeee", "changes:cccc"}));
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(StreamQueue, WhatIsPutBackIsAsItWas) {
  for (const Keep keep : {Keep::kNewest, Keep::kBegin, Keep::kOrder}) {
    StreamQueue queue(3000);
    queue.put("a", messages({"1", "2"}), keep);
    queue.put("b", messages({"3"}), Keep::kNewest);
    queue.put("c", messages({of_cost(2000, 'c')}), Keep::kOrder);
    const std::uint64_t bytes = queue.bytes();
    for (int i = 0; i < 2; ++i) queue.put_back(std::move(*queue.take()));
    EXPECT_EQ(queue.bytes(), bytes);
    // Parts, too: what is behind a first one in order counts.
    EXPECT_EQ(queue.put("c", messages({of_cost(2700, 'd')}), Keep::kOrder),
              keep == Keep::kOrder ? Put::kOverflow : Put::kTaken);
    EXPECT_EQ(take_all(queue).front(), "a:1");
    queue.put("b", messages({"4"}), keep);
    queue.put_back(std::move(*queue.take()));  // the only one
    queue.put("b", messages({"5"}), Keep::kNewest);
    EXPECT_EQ(take_all(queue), Strings{"b:5"});
    EXPECT_EQ(queue.bytes(), 0u);
    EXPECT_EQ(queue.given_up(), 1u);
  }
}

TEST(StreamQueue, WhatIsSpareHasNewerOnesOfItsTopicBehindIt) {
  StreamQueue queue(1 << 20);
  queue.put("motion", messages({"m1", "m2"}), Keep::kNewest);
  queue.put("begun", messages({"b1", "b2"}), Keep::kBegin);
  EXPECT_FALSE(queue.has_spare());
  queue.give_up_spare();
  EXPECT_EQ(queue.given_up(), 0u);
  queue.put("continued", messages({"c1", "c2"}), Keep::kBegin);
  for (const char* text : {"c3", "c4"}) queue.put("continued", messages({text}), Keep::kOrder);
  EXPECT_TRUE(queue.has_spare());
  queue.give_up_spare();
  EXPECT_FALSE(queue.has_spare());
  EXPECT_EQ(queue.given_up(), 3u);
  queue.put("continued", messages({"c5"}), Keep::kOrder);
  EXPECT_EQ(take_all(queue), (Strings{"motion:m1", "begun:b1", "continued:c4", "motion:m2",
                                      "begun:b2", "continued:c5"}));
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(StreamQueue, AMessageOutlivesItsPublication) {
  StreamQueue queue(1 << 20);
  queue.put("a", messages({"1", "2"}), Keep::kNewest);
  const auto first = queue.take();
  queue.clear();
  EXPECT_EQ(*first->bytes, "1");
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.take());
}

}  // namespace
}  // namespace limber::server
