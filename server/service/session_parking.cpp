#include "server/service/session_parking.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/log/log.h"
#include "server/runtime/stream_message.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

/// A client that has just opened a session and thinks about it is not to wait for it again.
constexpr std::chrono::seconds kLeastIdle{2};

}  // namespace

SessionParking::Room::~Room() {
  const std::lock_guard lock(parking_.mutex_);
  parking_.reserved_ -= bytes_;
}

std::uint64_t SessionParking::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& record : sessions_.all()) sum += record->memory_bytes();
  return sum;
}

std::unique_ptr<SessionParking::Room> SessionParking::make_room(const SessionMemory& memory) {
  const std::uint64_t limit = hub_.memory_limit();
  const std::uint64_t wanted = memory.building;
  {
    const std::lock_guard lock(mutex_);
    reserved_ += wanted;
  }
  auto room = std::make_unique<Room>(*this, wanted);
  const auto sum = [&] {
    const std::uint64_t sessions = bytes();
    const std::lock_guard lock(mutex_);
    return sessions + reserved_;
  };
  if (sum() <= limit) return room;
  const std::lock_guard one_at_a_time(parking_);
  for (const People people : {People::kAbsent, People::kAny}) {
    for (const auto& record : idle(kLeastIdle, people)) {
      if (sum() <= limit) break;
      (void)park(record);
    }
  }
  if (const std::uint64_t bytes = sum(); bytes > limit) throw no_room(wanted, bytes);
  return room;
}

Refusal SessionParking::no_room(std::uint64_t wanted, std::uint64_t bytes) const {
  const std::uint64_t limit = hub_.memory_limit();
  Refusal refusal =
      limit_exceeded("scene", "estimated bytes of all sessions together", limit, bytes);
  if (!hub_.store || wanted > limit) return refusal;
  std::vector<std::string> busy;
  for (const auto& record : sessions_.all())
    if (record->status().state() != proto::SESSION_STATE_FAILED) busy.push_back(record->id());
  if (busy.empty()) return refusal;
  constexpr std::size_t kNamed = 3;
  const std::size_t named = std::min(busy.size(), kNamed);
  const std::string names =
      fmt::format("{}{}", fmt::join(busy.begin(), busy.begin() + std::ptrdiff_t(named), ", "),
                  busy.size() > named ? ", ..." : "");
  return {refusal.code(), refusal.field(),
          fmt::format("{}; {} sessions are in use ({}) and make room once they rest: try again in "
                      "some seconds",
                      refusal.what(), busy.size(), names),
          refusal.details()};
}

void SessionParking::park_idle() {
  bool is_any = false;
  const auto now = FrameTransfers::Clock::now();
  for (const auto& record : sessions_.all())
    is_any = record->frame_transfers().sweep(now) || is_any;
  if (const auto after = hub_.options.park_after; after.count() > 0) {
    const std::lock_guard one_at_a_time(parking_);
    for (const auto& record : idle(after, People::kAny)) is_any = park(record) || is_any;
  }
  if (is_any) ::malloc_trim(0);  // what small sessions leave is in many holes of the heap
}

std::vector<std::shared_ptr<Record>> SessionParking::idle(std::chrono::nanoseconds since,
                                                          People people) const {
  if (!hub_.store) return {};
  const auto before = Record::Clock::now() - since;
  std::vector<std::pair<Record::Clock::time_point, std::shared_ptr<Record>>> found;
  for (auto& record : sessions_.all()) {
    const auto used_at = record->used_at();
    if (used_at <= before && (people == People::kAny || record->attendance().is_empty()))
      found.emplace_back(used_at, std::move(record));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::shared_ptr<Record>> records;
  records.reserve(found.size());
  for (auto& [used_at, record] : found) records.push_back(std::move(record));
  return records;
}

void publish_parked(Hub& hub, const SessionRegistry::Parked& parked) {
  const std::string topic = status_topic(parked.key.name);
  if (!hub.transport.has_subscriber(topic)) return;
  auto message = stream_message(hub.run, parked.key.name, parked.key.uid);
  *message.mutable_status() = parked.current_status();
  hub.transport.publish(topic, {message.SerializeAsString()});
}

bool SessionParking::park(const std::shared_ptr<Record>& record) {
  const std::unique_lock order(record->edit_order(), std::try_to_lock);
  if (!order.owns_lock() || !record->may_be_parked() || !hub_.store->fault().empty()) return false;
  try {
    const auto unused_since = record->used_at();
    if (!record->keep_answer_now()) return false;
    hub_.store->flush();
    if (!record->may_be_parked() || !hub_.store->fault().empty()) return false;
    proto::SessionStatus status = record->status();
    status.set_state(proto::SESSION_STATE_PARKED);
    status.clear_memory_bytes();
    if (!sessions_.park(record, status, unused_since)) return false;
    publish_parked(hub_, {record->key(), std::move(status), record->shared_attendance()});
  } catch (const std::exception& fault) {  // closed meanwhile
    log::debug("session {} is not parked: {}", record->id(), fault.what());
    return false;
  }
  record->leave_to_store();
  hub_.counters.parked.fetch_add(1, std::memory_order_relaxed);
  log::info("session {} is parked", record->id());
  return true;
}

}  // namespace limber::server
