#include "server/runtime/reply_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "server/wire/errors.h"

namespace limber::server {

proto::GetReplyPartResponse ReplyParts::cut(std::uint64_t number, const std::string& bytes,
                                            std::uint64_t offset, std::uint64_t most_bytes) {
  proto::GetReplyPartResponse part;
  part.set_reply(number);
  part.set_total_bytes(bytes.size());
  part.set_offset(offset);
  const std::uint64_t count = std::min({most_bytes, kMostBytes, bytes.size() - offset});
  part.set_data(bytes.data() + offset, static_cast<std::size_t>(count));
  return part;
}

proto::GetReplyPartResponse ReplyParts::begin(const std::string& client, std::string reply,
                                              UnreadReplies::Hold unread, std::uint64_t most_bytes,
                                              Clock::time_point now) {
  const auto begun = std::make_shared<Reply>(Reply{std::move(reply), std::move(unread), now});
  SharedReply gone;  // freed without the lock
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    Replies& own = by_client_[client];
    if (own.size() == kMostOfClient) gone = std::move(own.extract(own.begin()).mapped());
    number = ++last_;
    own.emplace(number, begun);
  }
  return cut(number, begun->bytes, 0, most_bytes);
}

proto::GetReplyPartResponse ReplyParts::part(const std::string& client,
                                             const proto::GetReplyPartRequest& request,
                                             Clock::time_point now) {
  if (request.most_bytes() == 0) throw invalid("most_bytes", "must be > 0");
  SharedReply reply;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    const auto own = by_client_.find(client);
    if (own != by_client_.end()) {
      const auto found = own->second.find(request.reply());
      if (found != own->second.end()) reply = found->second;
    }
    if (!reply)
      throw Error(ErrorCode::kFailedPrecondition, "reply",
                  "the server keeps no such reply of this connection any more: ask anew");
    const std::uint64_t total = reply->bytes.size();
    if (request.offset() >= total)
      throw invalid("offset", fmt::format("{} is not below the {} bytes of the reply",
                                          request.offset(), total));
    reply->used = now;
    if (std::min(request.most_bytes(), kMostBytes) >= total - request.offset()) {
      own->second.erase(request.reply());
      if (own->second.empty()) by_client_.erase(own);
    }
  }
  return cut(request.reply(), reply->bytes, request.offset(), request.most_bytes());
}

void ReplyParts::drop(const std::string& client) {
  Replies gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  if (auto own = by_client_.extract(client)) gone = std::move(own.mapped());
}

void ReplyParts::sweep(Clock::time_point now) {
  std::vector<SharedReply> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  for (auto own = by_client_.begin(); own != by_client_.end();) {
    for (auto one = own->second.begin(); one != own->second.end();) {
      const auto next = std::next(one);
      if (now - one->second->used > kPatience)
        gone.push_back(std::move(own->second.extract(one).mapped()));
      one = next;
    }
    const auto next = std::next(own);
    if (own->second.empty()) by_client_.erase(own);
    own = next;
  }
}

std::size_t ReplyParts::size() const {
  const std::lock_guard lock(mutex_);
  std::size_t count = 0;
  for (const auto& [client, replies] : by_client_) count += replies.size();
  return count;
}

}  // namespace limber::server
