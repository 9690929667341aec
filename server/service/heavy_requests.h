#pragma once

#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

#include "server/service/ticket.h"

namespace limber::server {

/// Requests that wait for a thread of a pool. Clients take turns, so that one who sends thousands
/// holds up another by no more than those that run; and the pool never has more than one entry per
/// thread from here, so that what else is posted to it (frames of streams) has its turn too.
class HeavyRequests {
 public:
  struct Request {
    SharedTicket ticket;
    zmq::message_t payload;
  };
  using Work = std::function<void(Request request)>;

  /// @param work        on the pool; must not throw
  /// @param most_bytes  that may wait; half of it of one client. A request that would wait alone is
  ///                    taken whatever its size.
  HeavyRequests(boost::asio::thread_pool& pool, int threads, std::uint64_t most_bytes, Work work);

  /// @throws Refusal LIMIT_EXCEEDED; the request is whole then
  void add(Request&& request);
  /// What waits, of one client or of all: it is the caller's to answer.
  [[nodiscard]] std::vector<Request> take(const std::string& client);
  [[nodiscard]] std::vector<Request> take_all();

 private:
  struct Line {
    std::deque<Request> requests;
    std::uint64_t bytes = 0;
  };

  void run_one();

  boost::asio::thread_pool& pool_;
  const int threads_;
  const std::uint64_t most_bytes_;
  const Work work_;
  std::mutex mutex_;                             // of what follows
  std::unordered_map<std::string, Line> lines_;  // of clients that have something waiting
  std::deque<std::string> turns_;                // the same clients, whose turn is next first
  std::uint64_t bytes_ = 0;                      // of all lines
  int runners_ = 0;                              // in the pool
};

}  // namespace limber::server
