// Streams against credit (follow.proto).
#include "server/service/service.h"
#include "server/transport/following.h"
#include "server/wire/errors.h"

namespace limber::server {

/// On the transport's thread.
void Service::follow(const SharedTicket& ticket, const Request& request) {
  if (ticket->way() != Ticket::Way::kSocket)
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "body",
                  "a WebSocket of requests has no streams: open one of /v1/stream");
  Following wanted = following_of(request.follow(), hub_.run.instance);
  wanted.client = ticket->client_number();
  wanted.name = ClientDirectory::identify(*ticket, request.client_name()).name;
  hub_.transport.follow(ticket->address(), std::move(wanted), [&](const FollowAnswer& answer) {
    if (answer.taken == FollowAnswer::Taken::kTooManyStreams)
      throw limit_exceeded("stream", "streams of a connection", Followers::kMostOfConnection,
                           Followers::kMostOfConnection + 1);
    if (answer.taken == FollowAnswer::Taken::kTooManyPrefixes)
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
  });
}

}  // namespace limber::server
