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
    line.requests.push_back(std::move(request));
    if (runners_ == threads_) return;  // one of them will come to it
    ++runners_;
  }
  boost::asio::post(pool_, [this] { run_one(); });
}

void HeavyRequests::run_one() {
  Request request;
  {
    const std::lock_guard lock(mutex_);
    if (turns_.empty()) {
      --runners_;
      return;
    }
    const std::string client = std::move(turns_.front());
    turns_.pop_front();
    Line& line = lines_.at(client);
    request = std::move(line.requests.front());
    line.requests.pop_front();
    line.bytes -= request.payload.size();
    bytes_ -= request.payload.size();
    if (line.requests.empty()) {
      lines_.erase(client);
    } else {
      turns_.push_back(client);
    }
  }
  work_(std::move(request));
  boost::asio::post(pool_, [this] { run_one(); });
}

std::vector<HeavyRequests::Request> HeavyRequests::take(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = lines_.find(client);
  if (found == lines_.end()) return {};
  auto& waiting = found->second.requests;
  std::vector<Request> taken(std::make_move_iterator(waiting.begin()),
                             std::make_move_iterator(waiting.end()));
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
  lines_.clear();
  turns_.clear();
  bytes_ = 0;
  return taken;
}

}  // namespace limber::server
