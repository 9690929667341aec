#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace limber::server {

/// Tasks of many clients for few threads: clients take turns, each with its oldest task, so that
/// one with many tasks holds up no other. Tasks may run for long, so some threads are left to later
/// clients: a client has no more tasks running than places are free. Out of ten places the first
/// client gets five, the next three. A task that waits for somebody may lend its place (LentPlace).
/// Thread-safe.
class TakingTurns {
 public:
  using Task = std::function<void()>;
  /// The share of places for the tasks of a client.
  enum class Share {
    kPart,
    kPartButOne,  // as kPart of one place less, which is left to the others
    kOne,         // one at a time, where two are free
    kAll,         // their number is bounded elsewhere
  };

  /// @param places  tasks that run at once, besides those that lend theirs
  /// @param more  has one more thread call run_one(), since a place is lent
  explicit TakingTurns(std::size_t places, std::function<void()> more = {})
      : more_(std::move(more)), free_(static_cast<std::ptrdiff_t>(places)) {}
  ~TakingTurns();
  TakingTurns(const TakingTurns&) = delete;
  TakingTurns& operator=(const TakingTurns&) = delete;

  /// @param share  the same for all tasks of a client
  void put(const std::string& client, Task task, Share share = Share::kPart);
  /// To be called once for each task, on one of the threads: runs one that waits, or leaves that to
  /// a thread that becomes free.
  void run_one();

 private:
  struct Client {
    std::deque<Task> waiting;
    std::ptrdiff_t running = 0;
    Share share = Share::kPart;
  };
  class Place;
  struct Taken {
    std::string client;
    Task task;
  };
  /// Without one, the call counts as done later. With the lock.
  [[nodiscard]] std::optional<Taken> take();
  /// Its task has ended. With the lock.
  void give_back(const std::string& client);

  const std::function<void()> more_;
  std::mutex mutex_;
  std::ptrdiff_t free_;   // places; fewer than none where some that were lent are taken back
  std::size_t left_ = 0;  // calls of run_one() that ran nothing
  std::map<std::string, Client> clients_;  // that wait or run
  std::deque<std::string> turns_;          // those that wait, the next one first
};

}  // namespace limber::server
