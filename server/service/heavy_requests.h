#pragma once

#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

#include "server/runtime/ticket.h"

namespace limber::server {

/// Bytes of requests that wait, in all lines that count in it. Thread-safe.
class WaitingBytes {
 public:
  /// @param most  half of it of one client. A request that would wait alone is taken at any size.
  explicit WaitingBytes(std::uint64_t most) : most_(most) {}
  /// @throws Refusal LIMIT_EXCEEDED: nothing is counted then
  void add(const std::string& client, std::uint64_t more);
  void remove(const std::string& client, std::uint64_t gone);

 private:
  const std::uint64_t most_;
  std::mutex mutex_;
  std::uint64_t all_ = 0;
  std::unordered_map<std::string, std::uint64_t> of_client_;  // of those that have any
};

/// Requests that wait for a thread of a pool. Clients take turns, so that one that sends thousands
/// delays another only by those that run. The pool never has more than one entry per thread from
/// here, so that other work in it (frames of streams) has its turn, too.
///
/// Requests that name a session here run one at a time per session, and those of a client in the
/// order of arrival; all others run in any order. One thread, where there are several, is left to
/// the others: long edits of several sessions hold up no export.
class HeavyRequests {
 public:
  struct Request {
    SharedTicket ticket;
    zmq::message_t payload;
    std::string session = {};  // empty: in any order
    std::uint64_t number = 0;  // in the order of arrival; 0: add() gives the next one
  };
  using Work = std::function<void(Request request)>;

  /// @param bytes  with what waits elsewhere; must outlive this
  /// @param work   on the pool; must not throw
  HeavyRequests(boost::asio::thread_pool& pool, int threads, WaitingBytes& bytes, Work work);

  /// One that was taken, and has another ticket now, keeps its place by its number.
  /// @throws Refusal LIMIT_EXCEEDED; the request is whole then
  void add(Request&& request);
  /// Does any request that names the session wait or run?
  [[nodiscard]] bool is_busy(const std::string& session) const;
  /// Waiting requests, of one client or of all: the caller answers them. Those of one client are in
  /// the order of arrival.
  [[nodiscard]] std::vector<Request> take(const std::string& client);
  [[nodiscard]] std::vector<Request> take_all();

  /// Number of looks at waiting requests, and of requests for a thread, since the start: both grow
  /// with the number of requests alone.
  struct Steps {
    std::uint64_t looks = 0, posts = 0;
  };
  [[nodiscard]] Steps steps() const;

  struct Waiting {
    std::uint64_t requests = 0, bytes = 0;
  };
  [[nodiscard]] Waiting waiting() const;

 private:
  using Queue = std::map<std::uint64_t, Request>;  // by number

  /// What one client has waiting.
  struct Line {
    std::unordered_map<std::string, Queue> queues;  // by session; none is empty
    // The queues that may continue, by the number of their first: those of sessions that nothing
    // runs for, and the one without a session.
    std::map<std::uint64_t, std::string> ready;
    std::uint64_t bytes = 0;
    std::list<std::string>::iterator turn;
  };

  /// For which something waits or runs.
  struct Session {
    std::list<std::string> clients;  // that have a queue for it
    bool is_running = false;
  };

  void run_one();
  // With the lock:
  [[nodiscard]] std::optional<Request> next();
  [[nodiscard]] Request start(Line& line, std::map<std::uint64_t, std::string>::iterator first);
  void end(const std::string& session);
  void insert(const std::string& client, Line& line, Request&& request);
  void erase_from(const std::string& session, const std::string& client);

  boost::asio::thread_pool& pool_;
  const int threads_, session_threads_;
  WaitingBytes& bytes_;
  const Work work_;
  mutable std::mutex mutex_;                     // of what follows
  std::unordered_map<std::string, Line> lines_;  // of clients that have something waiting
  std::list<std::string> turns_;                 // the same clients, in the order of their turns
  std::unordered_map<std::string, Session> sessions_;
  std::uint64_t last_ = 0;    // number
  int runners_ = 0;           // in the pool
  int running_sessions_ = 0;  // of the runners, those that work for a session
  Steps steps_;
};

}  // namespace limber::server
