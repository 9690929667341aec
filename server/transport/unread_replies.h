#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace limber::server {

/// Bytes of replies that have been made and not been written to the network: what a client that
/// does not read costs the server. Thread-safe.
class UnreadReplies {
 public:
  struct Limits {
    std::uint64_t client_bytes;  // of one; a client that has none may pass it by one reply
    std::uint64_t total_bytes;   // of all, never passed
  };
  /// Overhead of a message besides its bytes.
  static constexpr std::uint64_t kMessageBytes = 256;
  /// Short errors in place of refused replies have bytes of their own.
  static constexpr std::uint64_t kErrorBytes = 64u << 20, kErrorBytesOfClient = 1u << 20;

  enum class Kind { kReply, kError };
  /// Bytes that count as unread as long as this lives.
  class Hold {
   public:
    Hold(UnreadReplies& owner, std::string client, Kind kind, std::uint64_t bytes)
        : owner_(&owner), client_(std::move(client)), kind_(kind), bytes_(bytes) {}
    Hold(Hold&& other) noexcept
        : owner_(std::exchange(other.owner_, nullptr)),
          client_(std::move(other.client_)),
          kind_(other.kind_),
          bytes_(other.bytes_) {}
    Hold& operator=(Hold&& other) noexcept {
      std::swap(owner_, other.owner_);
      std::swap(client_, other.client_);
      std::swap(kind_, other.kind_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Hold() {
      if (owner_ != nullptr) owner_->release(client_, kind_, bytes_);
    }

   private:
    UnreadReplies* owner_;
    std::string client_;
    Kind kind_;
    std::uint64_t bytes_;
  };
  /// Why a reply is refused.
  struct Excess {
    enum class Of { kClient, kAll } of = Of::kClient;
    std::uint64_t limit = 0, value = 0;
  };

  explicit UnreadReplies(const Limits& limits) : limits_(limits) {}

  /// A client may have as much unread as is then still free of the total. One that does not read
  /// takes half of what the others leave, and there is always something left for the next.
  /// @param excess  why, where nothing is returned
  [[nodiscard]] std::optional<Hold> admit(const std::string& client, std::uint64_t bytes,
                                          Excess& excess);
  /// For a reply that is kept for a client to fetch: at most half of the client's limit, and a
  /// quarter of the free total, so that other messages have room.
  [[nodiscard]] std::optional<Hold> admit_kept(const std::string& client, std::uint64_t bytes);
  [[nodiscard]] std::optional<Hold> admit_error(const std::string& client, std::uint64_t bytes);
  [[nodiscard]] std::uint64_t total() const;
  /// Unread bytes of one client.
  struct Use {
    std::string client;
    std::uint64_t bytes = 0;
  };
  /// Those that leave most, most first.
  [[nodiscard]] std::vector<Use> uses(std::size_t most) const;

 private:
  struct Unread {
    std::uint64_t replies = 0, errors = 0;
  };
  // With the lock:
  [[nodiscard]] std::uint64_t replies_of(const std::string& client) const;  // [bytes]
  [[nodiscard]] Hold hold(const std::string& client, std::uint64_t cost);
  void release(const std::string& client, Kind kind, std::uint64_t bytes);

  const Limits limits_;
  mutable std::mutex mutex_;  // of what follows
  std::unordered_map<std::string, Unread> by_client_;
  Unread total_;
};

}  // namespace limber::server
