#include "server/service/heavy_requests.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <iterator>
#include <utility>

#include "server/codec/errors.h"

namespace limber::server {
namespace {

void demand_room(std::uint64_t waiting, std::uint64_t more, std::uint64_t most, const char* what) {
  if (waiting > 0 && waiting + more > most)
    throw limit_exceeded("body", what, most, waiting + more);
}

}  // namespace

HeavyRequests::HeavyRequests(boost::asio::thread_pool& pool, int threads, std::uint64_t most_bytes,
                             Work work)
    : pool_(pool), threads_(threads), most_bytes_(most_bytes), work_(std::move(work)) {}

void HeavyRequests::add(Request&& request) {
  const std::string& client = request.ticket->client();
  const std::uint64_t more = request.payload.size();
  {
    const std::lock_guard lock(mutex_);
    const auto found = lines_.find(client);
    demand_room(found == lines_.end() ? 0 : found->second.bytes, more, most_bytes_ / 2,
                "bytes of this client's requests that wait for a thread");
    demand_room(bytes_, more, most_bytes_, "bytes of requests that wait for a thread");
    if (found == lines_.end()) turns_.push_back(client);
    Line& line = lines_[client];
    line.bytes += more;
    bytes_ += more;
    if (!request.session.empty()) ++sessions_[request.session].requests;
    line.requests.push_back(std::move(request));
    if (runners_ == threads_) return;  // one of them will come to it
    ++runners_;
  }
  boost::asio::post(pool_, [this] { run_one(); });
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
    sessions_.at(session).is_running = false;
    leave(session);
  }
  boost::asio::post(pool_, [this] { run_one(); });
}

/// The first, of the client whose turn it is, whose session nothing else is done for.
std::optional<HeavyRequests::Request> HeavyRequests::next() {
  for (std::size_t clients = turns_.size(); clients > 0; --clients) {
    const std::string client = std::move(turns_.front());
    turns_.pop_front();
    Line& line = lines_.at(client);
    const auto found =
        std::find_if(line.requests.begin(), line.requests.end(), [&](const Request& request) {
          return request.session.empty() || !sessions_.at(request.session).is_running;
        });
    std::optional<Request> request;
    if (found != line.requests.end()) {
      request = std::move(*found);
      line.requests.erase(found);
      line.bytes -= request->payload.size();
      bytes_ -= request->payload.size();
      if (!request->session.empty()) sessions_.at(request->session).is_running = true;
    }
    if (line.requests.empty()) {
      lines_.erase(client);
    } else {
      turns_.push_back(client);
    }
    if (request) return request;
  }
  return std::nullopt;
}

void HeavyRequests::leave(const std::string& session) {
  if (session.empty()) return;
  const auto found = sessions_.find(session);
  if (--found->second.requests == 0) sessions_.erase(found);
}

bool HeavyRequests::is_busy(const std::string& session) const {
  const std::lock_guard lock(mutex_);
  return sessions_.contains(session);
}

std::vector<HeavyRequests::Request> HeavyRequests::take(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = lines_.find(client);
  if (found == lines_.end()) return {};
  auto& waiting = found->second.requests;
  std::vector<Request> taken(std::make_move_iterator(waiting.begin()),
                             std::make_move_iterator(waiting.end()));
  for (const Request& request : taken) leave(request.session);
  bytes_ -= found->second.bytes;
  lines_.erase(found);
  std::erase(turns_, client);
  return taken;
}

std::vector<HeavyRequests::Request> HeavyRequests::take_all() {
  const std::lock_guard lock(mutex_);
  std::vector<Request> taken;
  for (auto& [client, line] : lines_)
    std::move(line.requests.begin(), line.requests.end(), std::back_inserter(taken));
  for (const Request& request : taken) leave(request.session);
  lines_.clear();
  turns_.clear();
  bytes_ = 0;
  return taken;
}

}  // namespace limber::server
