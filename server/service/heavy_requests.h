#pragma once

#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

#include "server/service/ticket.h"

namespace limber::server {

/// Requests that wait for a thread of a pool. Clients take turns, so that one who sends thousands
/// holds up another by no more than those that run; and the pool never has more than one entry per
/// thread from here, so that what else is posted to it (frames of streams) has its turn too.
///
/// Of a session, requests that name it here are worked on one at a time, those of a client in the
/// order in which they came; all others in any order.
class HeavyRequests {
 public:
  struct Request {
    SharedTicket ticket;
    zmq::message_t payload;
    std::string session = {};  // empty: in any order
  };
  using Work = std::function<void(Request request)>;

  /// @param work        on the pool; must not throw
  /// @param most_bytes  that may wait; half of it of one client. A request that would wait alone is
  ///                    taken whatever its size.
  HeavyRequests(boost::asio::thread_pool& pool, int threads, std::uint64_t most_bytes, Work work);

  /// @throws Refusal LIMIT_EXCEEDED; the request is whole then
  void add(Request&& request);
  /// Does any request that names the session wait or run?
  [[nodiscard]] bool is_busy(const std::string& session) const;
  /// What waits, of one client or of all: it is the caller's to answer.
  [[nodiscard]] std::vector<Request> take(const std::string& client);
  [[nodiscard]] std::vector<Request> take_all();

 private:
  struct Line {
    std::deque<Request> requests;
    std::uint64_t bytes = 0;
  };

  /// Of those that wait or run.
  struct Session {
    std::size_t requests = 0;
    bool is_running = false;
  };

  void run_one();
  // With the lock:
  [[nodiscard]] std::optional<Request> next();
  void leave(const std::string& session);

  boost::asio::thread_pool& pool_;
  const int threads_;
  const std::uint64_t most_bytes_;
  const Work work_;
  mutable std::mutex mutex_;                     // of what follows
  std::unordered_map<std::string, Line> lines_;  // of clients that have something waiting
  std::deque<std::string> turns_;                // the same clients, whose turn is next first
  std::unordered_map<std::string, Session> sessions_;
  std::uint64_t bytes_ = 0;  // of all lines
  int runners_ = 0;          // in the pool
};

}  // namespace limber::server
