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
  part.set_data(bytes.data() + offset,
                static_cast<std::size_t>(std::min(most_bytes, bytes.size() - offset)));
  return part;
}

proto::GetReplyPartResponse ReplyParts::begin(const std::string& client, std::string reply,
                                              UnreadReplies::Hold unread, std::uint64_t most_bytes,
                                              Clock::time_point now) {
  const auto kept = std::make_shared<Kept>(Kept{client, std::move(reply), std::move(unread), now});
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = ++last_;
    kept_.emplace(number, kept);
  }
  return cut(number, kept->bytes, 0, most_bytes);
}

proto::GetReplyPartResponse ReplyParts::part(const std::string& client,
                                             const proto::GetReplyPartRequest& wanted,
                                             Clock::time_point now) {
  if (wanted.most_bytes() == 0) throw invalid("most_bytes", "must be > 0");
  SharedKept kept;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(wanted.reply());
    if (found == kept_.end() || found->second->client != client)
      throw Error(ErrorCode::kFailedPrecondition, "reply",
                  "there is no such reply any more of which parts could be fetched: ask anew");
    kept = found->second;
    const std::uint64_t total = kept->bytes.size();
    if (wanted.offset() >= total)
      throw invalid("offset", fmt::format("{} is not below the {} bytes of the reply",
                                          wanted.offset(), total));
    kept->asked = now;
    if (wanted.most_bytes() >= total - wanted.offset()) kept_.erase(found);
  }
  return cut(wanted.reply(), kept->bytes, wanted.offset(), wanted.most_bytes());
}

template <class Predicate>
void ReplyParts::erase_if(Predicate predicate) {
  std::vector<SharedKept> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  for (auto one = kept_.begin(); one != kept_.end();) {
    if (predicate(*one->second)) {
      gone.push_back(std::move(one->second));
      one = kept_.erase(one);
    } else {
      ++one;
    }
  }
}

void ReplyParts::drop(const std::string& client) {
  erase_if([&](const Kept& kept) { return kept.client == client; });
}

void ReplyParts::sweep(Clock::time_point now) {
  erase_if([&](const Kept& kept) { return now - kept.asked > kPatience; });
}

std::size_t ReplyParts::size() const {
  const std::lock_guard lock(mutex_);
  return kept_.size();
}

}  // namespace limber::server
