#include "server/service/heavy_requests.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

void demand_room(std::uint64_t waiting, std::uint64_t more, std::uint64_t most, const char* what) {
  if (waiting > 0 && waiting + more > most)
    throw limit_exceeded("body", what, most, waiting + more);
}

}  // namespace

void WaitingBytes::add(const std::string& client, std::uint64_t more) {
  const std::lock_guard lock(mutex_);
  const auto own = of_client_.find(client);
  demand_room(own == of_client_.end() ? 0 : own->second, more, most_ / 2,
              "bytes of this client's requests that wait for a thread");
  demand_room(all_, more, most_, "bytes of requests that wait for a thread");
  all_ += more;
  of_client_[client] += more;
}

void WaitingBytes::remove(const std::string& client, std::uint64_t gone) {
  const std::lock_guard lock(mutex_);
  all_ -= gone;
  const auto own = of_client_.find(client);
  if (own != of_client_.end() && (own->second -= gone) == 0) of_client_.erase(own);
}

HeavyRequests::HeavyRequests(boost::asio::thread_pool& pool, int threads, WaitingBytes& bytes,
                             Work work)
    : pool_(pool),
      threads_(threads),
      session_threads_(std::max(1, threads - 1)),
      bytes_(bytes),
      work_(std::move(work)) {}

void HeavyRequests::add(Request&& request) {
  const std::string client = request.ticket->client();
  const std::uint64_t more = request.payload.size();
  {
    const std::lock_guard lock(mutex_);
    bytes_.add(client, more);
    const auto found = lines_.find(client);
    Line& line = found == lines_.end() ? lines_[client] : found->second;
    if (found == lines_.end()) line.turn = turns_.insert(turns_.end(), client);
    line.bytes += more;
    // A thread that works for the session, or one that works for another while no more may, comes
    // to it by itself.
    bool may_run = true;
    if (!request.session.empty()) {
      const auto session = sessions_.find(request.session);
      may_run = running_sessions_ < session_threads_ &&
                (session == sessions_.end() || !session->second.is_running);
    }
    insert(client, line, std::move(request));
    if (!may_run || runners_ == threads_) return;
    ++runners_;
    ++steps_.posts;
  }
  boost::asio::post(pool_, [this] { run_one(); });
}

void HeavyRequests::insert(const std::string& client, Line& line, Request&& request) {
  if (request.number == 0) request.number = ++last_;
  const std::string session = request.session;
  const std::uint64_t number = request.number;
  Queue& queue = line.queues[session];
  const std::uint64_t first = queue.empty() ? 0 : queue.begin()->first;
  bool is_ready = true;
  if (!session.empty()) {
    Session& its = sessions_[session];
    is_ready = !its.is_running;
    if (queue.empty()) its.clients.push_back(client);
  }
  queue.emplace(number, std::move(request));
  if (!is_ready || (first != 0 && first < number)) return;
  if (first != 0) line.ready.erase(first);
  line.ready.emplace(number, session);
}

void HeavyRequests::run_one() {
  std::optional<Request> request;
  {
    const std::lock_guard lock(mutex_);
    request = next();
    if (!request) {  // what waits for a session is for the thread that works for it
      --runners_;
      return;
    }
  }
  const std::string session = request->session;
  work_(std::move(*request));
  if (!session.empty()) {
    const std::lock_guard lock(mutex_);
    end(session);
  }
  boost::asio::post(pool_, [this] { run_one(); });
}

/// The first request of the next client whose session is not busy.
std::optional<HeavyRequests::Request> HeavyRequests::next() {
  const bool sessions_may_run = running_sessions_ < session_threads_;
  for (std::size_t clients = turns_.size(); clients > 0; --clients) {
    ++steps_.looks;
    Line& line = lines_.at(turns_.front());
    turns_.splice(turns_.end(), turns_, turns_.begin());
    auto first = line.ready.begin();
    if (!sessions_may_run) {
      const auto of_none = line.queues.find("");
      first = of_none == line.queues.end() ? line.ready.end()
                                           : line.ready.find(of_none->second.begin()->first);
    }
    if (first != line.ready.end()) return start(line, first);
  }
  return std::nullopt;
}

HeavyRequests::Request HeavyRequests::start(Line& line,
                                            std::map<std::uint64_t, std::string>::iterator first) {
  const std::string session = first->second, client = *line.turn;
  line.ready.erase(first);
  Queue& queue = line.queues.at(session);
  Request request = std::move(queue.begin()->second);
  queue.erase(queue.begin());
  line.bytes -= request.payload.size();
  bytes_.remove(client, request.payload.size());
  if (!session.empty()) {
    Session& its = sessions_.at(session);
    its.is_running = true;
    ++running_sessions_;
    for (const std::string& other : its.clients) {
      ++steps_.looks;
      if (other == client) continue;
      Line& waiting = lines_.at(other);
      waiting.ready.erase(waiting.queues.at(session).begin()->first);
    }
  } else if (!queue.empty()) {
    line.ready.emplace(queue.begin()->first, session);
  }
  if (queue.empty()) {
    line.queues.erase(session);
    erase_from(session, client);
  }
  if (line.queues.empty()) {
    turns_.erase(line.turn);
    lines_.erase(client);
  }
  return request;
}

/// A thread has finished a request of the session.
void HeavyRequests::end(const std::string& session) {
  --running_sessions_;
  const auto its = sessions_.find(session);
  its->second.is_running = false;
  for (const std::string& client : its->second.clients) {
    ++steps_.looks;
    Line& line = lines_.at(client);
    line.ready.emplace(line.queues.at(session).begin()->first, session);
  }
  if (its->second.clients.empty()) sessions_.erase(its);
}

/// The client has nothing waiting for the session any more.
void HeavyRequests::erase_from(const std::string& session, const std::string& client) {
  const auto its = sessions_.find(session);
  if (its == sessions_.end()) return;
  its->second.clients.remove(client);
  if (its->second.clients.empty() && !its->second.is_running) sessions_.erase(its);
}

bool HeavyRequests::is_busy(const std::string& session) const {
  const std::lock_guard lock(mutex_);
  return sessions_.contains(session);
}

std::vector<HeavyRequests::Request> HeavyRequests::take(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = lines_.find(client);
  if (found == lines_.end()) return {};
  std::vector<Request> taken;
  for (auto& [session, queue] : found->second.queues) {
    for (auto& [number, request] : queue) taken.push_back(std::move(request));
    erase_from(session, client);
  }
  std::sort(taken.begin(), taken.end(),
            [](const Request& a, const Request& b) { return a.number < b.number; });
  bytes_.remove(client, found->second.bytes);
  turns_.erase(found->second.turn);
  lines_.erase(found);
  return taken;
}

std::vector<HeavyRequests::Request> HeavyRequests::take_all() {
  const std::lock_guard lock(mutex_);
  std::vector<Request> taken;
  for (auto& [client, line] : lines_) {
    for (auto& [session, queue] : line.queues) {
      for (auto& [number, request] : queue) taken.push_back(std::move(request));
      erase_from(session, client);
    }
    bytes_.remove(client, line.bytes);
  }
  lines_.clear();
  turns_.clear();
  return taken;
}

HeavyRequests::Waiting HeavyRequests::waiting() const {
  const std::lock_guard lock(mutex_);
  Waiting waiting;
  for (const auto& [client, line] : lines_) {
    waiting.bytes += line.bytes;
    for (const auto& [session, queue] : line.queues) waiting.requests += queue.size();
  }
  return waiting;
}

HeavyRequests::Steps HeavyRequests::steps() const {
  const std::lock_guard lock(mutex_);
  return steps_;
}

}  // namespace limber::server
