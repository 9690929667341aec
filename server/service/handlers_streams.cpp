// Streams against credit (follow.proto).
#include <fmt/format.h>

#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::size_t kMostNameBytes = 64;

Following following_of(const proto::FollowRequest& request, const std::string& instance) {
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

}  // namespace

/// On the transport's thread.
void Service::follow(const SharedTicket& ticket, const Request& request) {
  if (ticket->way() != Ticket::Way::kSocket)
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "body",
                  "a WebSocket of requests has no streams: open one of /v1/stream");
  Following wanted = following_of(request.follow(), hub_.run.instance);
  wanted.client = ticket->client_number();
  wanted.name = ClientDirectory::identify(*ticket, request.client_name()).name;
  const FollowAnswer answer = hub_.transport.follow(ticket->address(), std::move(wanted));
  if (!answer.is_taken)
    throw Refusal(proto::ERROR_CODE_LIMIT_EXCEEDED, "topics",
                  "all streams together have too many prefixes of topics",
                  {{"limit", std::to_string(Subscriptions::kMaxPrefixes)}});
  proto::Reply reply;
  auto& follow = *reply.mutable_follow();
  follow.set_continued(answer.continued);
  follow.set_cut_off(answer.cut_off);
  follow.set_left_out(answer.left_out);
  follow.set_window_bytes(answer.window_bytes);
  ticket->answer(std::move(reply));
}

}  // namespace limber::server
