#include "server/runtime/attendance.h"

#include <algorithm>
#include <utility>

namespace limber::server {
namespace {

double seconds(Attendance::Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Attendance::Present* Attendance::find(std::uint64_t number) {
  const auto found = std::find_if(present_.begin(), present_.end(),
                                  [&](const Present& one) { return one.client.number == number; });
  return found == present_.end() ? nullptr : &*found;
}

Attendance::Joined Attendance::join(const ClientIdentity& client, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (Present* const known = find(client.number)) {
    known->client.name = client.name;
    return Joined::kAgain;
  }
  if (present_.size() >= kMaxClients) return Joined::kFull;
  present_.push_back({client, now});
  // A client that left and is back: its revisions are known.
  for (const Made& made : made_) {
    if (made.client.number != client.number) continue;
    present_.back().last_revision = made.revision;
    break;
  }
  return Joined::kNew;
}

bool Attendance::leave(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(present_, [&](const Present& one) { return one.client.number == number; }) >
         0;
}

void Attendance::note_revision(const ClientIdentity& client, std::uint64_t revision,
                               std::vector<std::string> edits, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (Present* const known = find(client.number))
    known->last_revision = std::max(known->last_revision, revision);
  // Edits of several threads may be noted in another order than they were made.
  const auto at = std::find_if(made_.begin(), made_.end(),
                               [&](const Made& made) { return made.revision < revision; });
  if (at != made_.end() && at->revision + 1 == revision && at->client.number == client.number &&
      at->client.name == client.name && at->edits == edits) {
    at->revision = revision;
    at->at = now;
    return;
  }
  made_.insert(at, {revision, revision, client, std::move(edits), now});
  if (made_.size() > kMaxRevisions) made_.pop_back();
}

std::vector<proto::StoredMaker> Attendance::makers(Clock::time_point now,
                                                   std::uint64_t now_ms) const {
  const std::lock_guard lock(mutex_);
  std::vector<proto::StoredMaker> makers;
  for (const Made& made : made_) {
    proto::StoredMaker& maker = makers.emplace_back();
    maker.set_first(made.first);
    maker.set_revision(made.revision);
    maker.set_name(made.client.name);
    for (const std::string& edit : made.edits) maker.add_edits(edit);
    const auto age = std::chrono::duration_cast<std::chrono::milliseconds>(now - made.at).count();
    maker.set_at_ms(now_ms - static_cast<std::uint64_t>(std::max<std::int64_t>(age, 0)));
  }
  return makers;
}

void Attendance::recall(const google::protobuf::RepeatedPtrField<proto::StoredMaker>& makers,
                        Clock::time_point now, std::uint64_t now_ms) {
  const std::lock_guard lock(mutex_);
  for (const proto::StoredMaker& maker : makers) {
    if (made_.size() == kMaxRevisions) return;
    const std::chrono::milliseconds age(now_ms > maker.at_ms() ? now_ms - maker.at_ms() : 0);
    Made& made = made_.emplace_back();
    made.revision = maker.revision();
    made.first = maker.first();
    made.client.name = maker.name();
    made.edits.assign(maker.edits().begin(), maker.edits().end());
    made.at = now - age;
  }
}

template <class Message>
void Attendance::add_people(Message& message, Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  for (const Present& one : present_) {
    auto& client = *message.add_clients();
    client.set_client(one.client.number);
    client.set_name(one.client.name);
    client.set_present_s(seconds(now - one.since));
    client.set_last_revision(one.last_revision);
  }
  for (const Made& made : made_) {
    auto& revision = *message.add_revisions();
    revision.set_revision(made.revision);
    revision.set_first(made.first);
    revision.set_client(made.client.number);
    revision.set_name(made.client.name);
    for (const std::string& edit : made.edits) revision.add_edits(edit);
    revision.set_age_s(seconds(now - made.at));
  }
}

bool Attendance::is_empty() const {
  const std::lock_guard lock(mutex_);
  return present_.empty();
}

void Attendance::describe(proto::SessionStatus& status, Clock::time_point now) const {
  status.set_age_s(seconds(now - opened_));
  add_people(status, now);
}

void Attendance::describe(proto::JoinSessionResponse& response, Clock::time_point now) const {
  add_people(response, now);
}

}  // namespace limber::server
