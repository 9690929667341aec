#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

namespace limber::server {

class Ticket;

/// Whose request, and which: a request that changes something is applied once.
struct RequestKey {
  std::string client;    // as it names itself, else its connection
  std::uint64_t id = 0;  // > 0
};

/// How clients of RequestKey begin that name themselves; connections do not.
inline constexpr const char* kNamedClient = "client ";
[[nodiscard]] inline bool is_of_connection(const RequestKey& key) {
  return key.client.rfind(kNamedClient, 0) != 0;
}

/// Hash of a request's bytes, to distinguish a repetition from another request under the same id.
/// If there are more than 4 MiB, 4 KiB out of every 64 KiB are read.
[[nodiscard]] std::uint64_t content_hash(std::string_view bytes);

/// Replies to requests that changed something, kept for a while: a client that repeats such a
/// request gets the stored reply, and nothing is done twice. Thread-safe.
class StoredReplies {
 public:
  using Clock = std::chrono::steady_clock;

  /// Limits of given replies; the oldest are dropped first. Those in progress are not counted.
  struct Limits {
    std::size_t client_replies = 256;  // of one client
    std::size_t client_bytes = 1 << 20;
    std::size_t total_bytes = 64 << 20;  // of all clients, with what an entry itself takes
    std::chrono::seconds age{600};
  };
  enum class Verdict {
    kNew,        // to be done; its ticket ends it by answer() or abandon()
    kRunning,    // its reply will come, to the newest connection as well
    kAnswered,   // `reply` is what it got
    kTooLarge,   // it was done, but its reply was too large to be kept
    kDifferent,  // the id was another request's
  };
  struct Finding {
    Verdict verdict = Verdict::kNew;
    std::string reply;
  };

  StoredReplies();
  explicit StoredReplies(Limits limits) : limits_(limits) {}

  /// A request has come.
  /// @param ticket  answers it; kept of a repetition on another connection until the reply is there
  [[nodiscard]] Finding begin(const RequestKey& key, std::uint64_t hash,
                              const std::shared_ptr<Ticket>& ticket, Clock::time_point now);
  /// @returns who repeated the request meanwhile and is to get the same bytes; may be null
  [[nodiscard]] std::shared_ptr<Ticket> answer(const RequestKey& key, const std::string& reply,
                                               Clock::time_point now);
  /// From a run before this one: a request that was answered, and its reply.
  void recall(const RequestKey& key, std::uint64_t hash, std::string reply, Clock::time_point now);
  /// The client disconnected before anything was done.
  /// @returns who repeated the request on another connection: the request is theirs now; or null,
  /// then it is forgotten
  [[nodiscard]] std::shared_ptr<Ticket> abandon(const RequestKey& key);
  /// The request is refused before anything was done: it is forgotten, so that the same request may
  /// come again.
  /// @returns who repeated the request meanwhile and is to get the same refusal; may be null
  [[nodiscard]] std::shared_ptr<Ticket> forget(const RequestKey& key);

  [[nodiscard]] std::size_t bytes() const;  // that count against Limits.total_bytes
  [[nodiscard]] std::size_t size() const;   // requests answered and kept, of all clients

 private:
  struct Entry {
    std::uint64_t hash = 0;
    std::string connection;  // of its ticket
    bool is_answered = false, is_too_large = false;
    std::string reply;
    std::shared_ptr<Ticket> repeated;  // on another connection
    Clock::time_point answered_at;
    std::list<RequestKey>::iterator place;  // in oldest_first_, once it is answered
  };
  struct Client {
    std::unordered_map<std::uint64_t, Entry> entries;
    std::deque<std::uint64_t> answered;  // oldest first
    std::size_t bytes = 0;
  };

  void drop_oldest_of(const std::string& name);
  void drop_expired(Clock::time_point now);

  const Limits limits_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Client> clients_;
  std::list<RequestKey> oldest_first_;  // that are answered
  std::size_t bytes_ = 0;
};

}  // namespace limber::server
