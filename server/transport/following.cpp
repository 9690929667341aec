#include "server/transport/following.h"

#include <fmt/format.h>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::size_t kMostNameBytes = 64;

}  // namespace

Following following_of(const v1::FollowRequest& request, const std::string& instance) {
  if (request.stream().empty() || request.stream().size() > kMostNameBytes)
    throw invalid("stream", fmt::format("{} bytes; 1 to {} are allowed", request.stream().size(),
                                        kMostNameBytes));
  const auto topics = static_cast<std::uint64_t>(request.topics_size());
  if (topics > Subscriptions::kMaxOfOne)
    throw limit_exceeded("topics", "topics of a stream", Subscriptions::kMaxOfOne, topics);
  Following wanted;
  wanted.stream = request.stream();
  wanted.read_bytes = request.read_bytes();
  wanted.window_bytes = request.window_bytes();
  const bool is_of_this_run = request.instance() == instance;
  for (int i = 0; i < request.topics_size(); ++i) {
    const auto& topic = request.topics(i);
    if (topic.prefix().size() > Subscriptions::kLongestTopic)
      throw invalid(fmt::format("topics[{}].prefix", i),
                    fmt::format("{} bytes; topics have at most {}", topic.prefix().size(),
                                Subscriptions::kLongestTopic));
    wanted.topics.push_back({topic.prefix(), is_of_this_run ? topic.after() : 0});
  }
  return wanted;
}

}  // namespace limber::server
