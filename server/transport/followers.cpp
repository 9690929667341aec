#include "server/transport/followers.h"

#include <algorithm>
#include <utility>

namespace limber::server {
namespace {

std::string message_of_subscription(char what, const std::string& prefix) {
  return std::string(1, what) + prefix;
}

}  // namespace

std::string Followers::place_of(const Address& address) {
  std::string place;
  for (const std::string& frame : address.envelope)
    place += std::to_string(frame.size()) + ':' + frame;
  return place;
}

Followers::OfConnection Followers::of_connection(const std::string& connection) const {
  OfConnection found;
  for (const auto& [place, follower] : attached_) {
    if (follower->connection() != connection) continue;
    ++found.streams;
    found.group = follower->group;
  }
  return found;
}

Followers::Begun Followers::follow(const Address& address, Following wanted, std::uint64_t number,
                                   Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const std::string place = place_of(address);
  const std::string key = address.key + '\n' + wanted.stream;
  Begun begun;
  // A place has one stream, a stream one place: the newest counts.
  if (const auto other = attached_.find(place);
      other != attached_.end() && other->second->key != key)
    remember(detach(other), "its connection was given another stream");
  if (const auto before = place_of_stream_.find(key);
      before != place_of_stream_.end() && before->second != place)
    remember(detach(attached_.find(before->second)), "it came again on another connection");

  auto found = attached_.find(place);
  if (found != attached_.end()) {
    begun.answer.continued = true;
    found->second->stream.credit(wanted.read_bytes, now);
  } else if (!wanted.topics.empty()) {
    const auto beside = of_connection(address.envelope.front());
    if (beside.streams >= kMostOfConnection) {
      begun.answer.taken = FollowAnswer::Taken::kTooManyStreams;
      return begun;
    }
    auto follower = std::make_unique<Follower>(Follower{number,
                                                        beside.streams > 0 ? beside.group : number,
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
      forget(known);
    }
    found = attached_.emplace(place, std::move(follower)).first;
    place_of_stream_[key] = place;
  } else {
    return begun;
  }
  Follower& follower = *found->second;
  follower.stream.set_window(wanted.window_bytes);
  begun.answer.window_bytes = follower.stream.window();
  begun.answer.left_out = follower.stream.left_out();
  if (!want(follower, wanted.topics, begun.fresh))
    begun.answer.taken = FollowAnswer::Taken::kTooManyPrefixes;
  if (wanted.topics.empty() || begun.answer.taken != FollowAnswer::Taken::kYes) {
    detach(found);
    return begun;
  }
  begun.follower = &follower;
  return begun;
}

bool Followers::want(Follower& follower, const std::vector<Following::Topic>& topics,
                     std::vector<Following::Topic>& fresh) {
  std::set<std::string> wanted;
  for (const auto& topic : topics) wanted.insert(topic.prefix);
  // First, so that other topics may take the place of as many as one may have.
  for (const auto& prefix : follower.prefixes) {
    if (!wanted.contains(prefix))
      subscriptions_.note(follower.number, message_of_subscription(0, prefix), follower.group);
  }
  std::set<std::string> seen = follower.prefixes;
  for (const auto& topic : topics) {
    if (!seen.insert(topic.prefix).second) continue;
    const auto noted = subscriptions_.note(
        follower.number, message_of_subscription(1, topic.prefix), follower.group);
    if (noted != Subscriptions::Noted::kSubscription) return false;
    fresh.push_back(topic);
  }
  follower.prefixes = std::move(wanted);
  return true;
}

std::unique_ptr<Followers::Follower> Followers::detach(Attached::iterator found) {
  auto follower = std::move(found->second);
  attached_.erase(found);
  place_of_stream_.erase(follower->key);
  subscriptions_.forget(follower->number);
  return follower;
}

void Followers::remember(std::unique_ptr<Follower> follower, std::string reason) {
  follower->stream.suspend();
  const std::string& key = follower->key;
  if (const auto known = remembered_.find(key); known != remembered_.end()) forget(known);
  const auto place = remembered_order_.insert(remembered_order_.end(), key);
  remembered_.emplace(key, Remembered{std::move(follower->stream), std::move(reason), place});
  if (remembered_.size() > kMostRemembered) forget(remembered_.find(remembered_order_.front()));
}

void Followers::forget(std::map<std::string, Remembered>::iterator known) {
  remembered_order_.erase(known->second.place);
  remembered_.erase(known);
}

void Followers::end(const Follower& follower, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (const auto found = attached_.find(place_of(follower.address)); found != attached_.end())
    remember(detach(found), reason);
}

void Followers::end_connection(const std::string& connection, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  for (auto next = attached_.begin(); next != attached_.end();) {
    const auto found = next++;
    if (found->second->connection() == connection) remember(detach(found), reason);
  }
}

void Followers::note_answer(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  for (auto& [place, follower] : attached_) {
    if (follower->number == number) follower->is_answered = true;
  }
}

const Followers::Follower* Followers::of_number(std::uint64_t number) const {
  for (const auto& [place, follower] : attached_) {
    if (follower->number == number) return follower.get();
  }
  return nullptr;
}

std::uint64_t Followers::publish(const std::string& topic, const SharedMessages& messages,
                                 TopicSlots::Keep keep, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::uint64_t given_up = 0;
  for (auto& [place, follower] : attached_) {
    if (!subscriptions_.is_subscribed(follower->number, topic)) continue;
    const std::uint64_t before = follower->stream.left_out();
    follower->stream.put(topic, messages, keep, now);
    given_up += follower->stream.left_out() - before;
  }
  return given_up;
}

std::vector<const Followers::Follower*> Followers::stalled(Clock::duration most,
                                                           Clock::time_point now) const {
  std::vector<const Follower*> found;
  for (const auto& [place, follower] : attached_) {
    if (follower->stream.stalled_for(now) >= most) found.push_back(follower.get());
  }
  return found;
}

const Followers::Follower* Followers::most_stalled(Clock::time_point now) const {
  const Follower* found = nullptr;
  auto longest = Clock::duration::zero();
  for (const auto& [place, follower] : attached_) {
    const auto stalled = follower->stream.stalled_for(now);
    if (stalled <= longest) continue;
    found = follower.get();
    longest = stalled;
  }
  return found;
}

template <class Condition>
Followers::Follower* Followers::largest_of(std::uint64_t limit, const Condition& condition) const {
  std::unordered_map<std::uint64_t, std::uint64_t> held_by;  // groups
  for (const auto& [place, follower] : attached_)
    held_by[follower->group] += follower->stream.held_bytes();
  const std::uint64_t share = limit / std::max<std::size_t>(held_by.size(), 1);
  Follower* found = nullptr;
  std::pair<std::uint64_t, std::uint64_t> most;  // of its connection, of itself
  for (const auto& [place, follower] : attached_) {
    const std::pair held{held_by[follower->group], follower->stream.held_bytes()};
    if (held.first <= share || held <= most || !condition(*follower)) continue;
    found = follower.get();
    most = held;
  }
  return found;
}

std::uint64_t Followers::withhold(std::uint64_t limit) {
  const std::lock_guard lock(mutex_);
  Follower* const largest =
      largest_of(limit, [](const Follower& one) { return one.stream.has_spare(); });
  return largest == nullptr ? 0 : largest->stream.give_up_spare();
}

const Followers::Follower* Followers::largest(std::uint64_t limit, Clock::time_point now) const {
  const auto* stalled = largest_of(limit, [now](const Follower& one) {
    return one.stream.stalled_for(now) > Clock::duration::zero();
  });
  return stalled != nullptr ? stalled : largest_of(limit, [](const Follower&) { return true; });
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
    for (const auto& [place, follower] : attached_) {
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
