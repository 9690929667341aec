#include "server/transport/followers.h"

#include <algorithm>
#include <utility>

namespace limber::server {
namespace {

std::string message_of_subscription(char what, const std::string& prefix) {
  return std::string(1, what) + prefix;
}

}  // namespace

Followers::Begun Followers::follow(const Address& address, Following wanted, std::uint64_t number,
                                   Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const std::string& client = address.envelope.front();
  const std::string key = address.key + '\n' + wanted.stream;
  Begun begun;
  // A connection has one stream, a stream one connection: the newest counts.
  if (const auto other = attached_.find(client);
      other != attached_.end() && other->second->key != key)
    remember(detach(other), "its connection was given another stream");
  if (const auto before = client_of_stream_.find(key);
      before != client_of_stream_.end() && before->second != client)
    remember(detach(attached_.find(before->second)), "it came again on another connection");

  auto found = attached_.find(client);
  if (found != attached_.end()) {
    begun.answer.continued = true;
    found->second->stream.credit(wanted.read_bytes, now);
  } else if (!wanted.topics.empty()) {
    auto follower = std::make_unique<Follower>(Follower{number,
                                                        key,
                                                        address,
                                                        wanted.client,
                                                        std::move(wanted.name),
                                                        {},
                                                        FollowedStream(queue_bytes_)});
    if (const auto known = remembered_.find(key); known != remembered_.end()) {
      begun.answer.continued = true;
      begun.answer.cut_off = std::move(known->second.reason);
      follower->stream = std::move(known->second.stream);
      follower->stream.resume(wanted.read_bytes, now);
      remembered_.erase(known);
      std::erase(remembered_order_, key);
    }
    found = attached_.emplace(client, std::move(follower)).first;
    client_of_stream_[key] = client;
  } else {
    return begun;
  }
  Follower& follower = *found->second;
  follower.stream.set_window(wanted.window_bytes);
  begun.answer.window_bytes = follower.stream.window();
  begun.answer.left_out = follower.stream.left_out();
  begun.answer.is_taken = want(follower, wanted.topics, begun.fresh);
  if (wanted.topics.empty() || !begun.answer.is_taken) {
    detach(found);
    return begun;
  }
  begun.follower = &follower;
  return begun;
}

bool Followers::want(Follower& follower, const std::vector<Following::Topic>& topics,
                     std::vector<Following::Topic>& fresh) {
  std::set<std::string> wanted;
  for (const auto& topic : topics) {
    if (!wanted.insert(topic.prefix).second || follower.prefixes.contains(topic.prefix)) continue;
    const auto noted =
        subscriptions_.note(follower.number, message_of_subscription(1, topic.prefix));
    if (noted != Subscriptions::Noted::kSubscription) return false;
    fresh.push_back(topic);
  }
  for (const auto& prefix : follower.prefixes) {
    if (!wanted.contains(prefix))
      subscriptions_.note(follower.number, message_of_subscription(0, prefix));
  }
  follower.prefixes = std::move(wanted);
  return true;
}

std::unique_ptr<Followers::Follower> Followers::detach(Attached::iterator found) {
  auto follower = std::move(found->second);
  attached_.erase(found);
  client_of_stream_.erase(follower->key);
  subscriptions_.forget(follower->number);
  return follower;
}

void Followers::remember(std::unique_ptr<Follower> follower, std::string reason) {
  follower->stream.suspend();
  remembered_.insert_or_assign(follower->key,
                               Remembered{std::move(follower->stream), std::move(reason)});
  remembered_order_.push_back(follower->key);
  while (remembered_order_.size() > kMostRemembered) {
    remembered_.erase(remembered_order_.front());
    remembered_order_.pop_front();
  }
}

void Followers::end(const std::string& client, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (const auto found = attached_.find(client); found != attached_.end())
    remember(detach(found), reason);
}

Followers::Follower* Followers::of_client(const std::string& client) {
  const auto found = attached_.find(client);
  return found == attached_.end() ? nullptr : found->second.get();
}

Followers::Follower* Followers::of_number(std::uint64_t number) {
  for (auto& [client, follower] : attached_) {
    if (follower->number == number) return follower.get();
  }
  return nullptr;
}

std::uint64_t Followers::publish(const std::string& topic, const SharedMessages& messages,
                                 TopicSlots::Keep keep, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::uint64_t given_up = 0;
  for (auto& [client, follower] : attached_) {
    if (!subscriptions_.is_subscribed(follower->number, topic)) continue;
    const std::uint64_t before = follower->stream.left_out();
    follower->stream.put(topic, messages, keep, now);
    given_up += follower->stream.left_out() - before;
  }
  return given_up;
}

std::vector<std::string> Followers::stalled(Clock::duration most, Clock::time_point now) const {
  std::vector<std::string> found;
  for (const auto& [client, follower] : attached_) {
    if (follower->stream.stalled_for(now) >= most) found.push_back(client);
  }
  return found;
}

std::string Followers::most_stalled(Clock::time_point now) const {
  std::string found;
  auto longest = Clock::duration::zero();
  for (const auto& [client, follower] : attached_) {
    const auto stalled = follower->stream.stalled_for(now);
    if (stalled <= longest) continue;
    found = client;
    longest = stalled;
  }
  return found;
}

std::size_t Followers::size() const {
  const std::lock_guard lock(mutex_);
  return attached_.size();
}

std::vector<FollowerUse> Followers::uses(std::size_t most, Clock::time_point now) const {
  std::vector<FollowerUse> all;
  {
    const std::lock_guard lock(mutex_);
    all.reserve(attached_.size());
    for (const auto& [client, follower] : attached_) {
      const FollowedStream& stream = follower->stream;
      all.push_back({follower->client, follower->name,
                     static_cast<std::uint32_t>(follower->prefixes.size()), stream.waiting_bytes(),
                     stream.unread_bytes(), stream.sent(), stream.left_out(),
                     std::chrono::duration<double>(stream.stalled_for(now)).count()});
    }
  }
  std::sort(all.begin(), all.end(), [](const FollowerUse& a, const FollowerUse& b) {
    return a.waiting_bytes + a.unread_bytes > b.waiting_bytes + b.unread_bytes;
  });
  if (all.size() > most) all.resize(most);
  return all;
}

}  // namespace limber::server
