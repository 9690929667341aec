#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "limber/v1/service.pb.h"
#include "server/runtime/open_requests.h"
#include "server/runtime/reply_parts.h"
#include "server/runtime/stored_replies.h"
#include "server/transport/transport.h"

namespace limber::server {

namespace proto = limber::v1;

/// One request that must be answered, once. Shared by all possible sources of the answer; the first
/// answer counts. If all release it unanswered, it answers that the server is going down (its task
/// was dropped), so no client waits forever.
class Ticket {
 public:
  /// @param instance  of the run, for the reply
  Ticket(Transport& transport, Counters& counters, OpenRequests& open, Address address,
         std::uint64_t id, std::string instance = "");
  ~Ticket();
  Ticket(const Ticket&) = delete;
  Ticket& operator=(const Ticket&) = delete;

  /// Sets version and id. @returns false if it was answered before
  bool answer(proto::Reply reply);
  /// @param prefix  for fields the engine named, e.g. "scene."
  bool refuse(const std::exception& fault, const std::string& prefix = "");
  /// As refuse(), before anything of the request was done: it may come again under the same id.
  bool refuse_unbegun(const std::exception& fault);
  /// From now on its end is reported to `replies`. Before it is shared.
  /// @param hash  of the request's bytes
  void keep_reply(StoredReplies& replies, RequestKey key, std::uint64_t hash);
  /// A long reply goes in parts where there is room to keep it, the first of so many bytes. Not of
  /// a request that changes something. Before it is shared.
  void divide_reply(ReplyParts& parts, std::uint64_t most_bytes);
  /// For a request whose client has a name: the key that identifies a repetition.
  [[nodiscard]] const RequestKey& request_key() const { return key_; }
  [[nodiscard]] std::uint64_t request_hash() const { return hash_; }
  /// The bytes of a reply that the same request got before.
  void answer_again(std::string reply);
  /// For a client that has disconnected: nothing is sent.
  /// @returns the ticket that the request belongs to now, where the client repeated it on another
  /// connection; else null
  std::shared_ptr<Ticket> abandon();
  /// A repetition to which another ticket's reply will go.
  void absorb();
  [[nodiscard]] const std::string& client() const { return client_; }
  /// As the request came; before it is answered.
  [[nodiscard]] const Address& address() const { return address_; }
  /// How it came: by the request socket, or from a client of other ways (LocalPeer).
  enum class Way { kSocket, kLocalPeer };
  [[nodiscard]] Way way() const { return way_; }
  /// Its request changes something. Before it is shared.
  void note_lasting();
  /// The role of the client.
  [[nodiscard]] Role role() const { return role_; }
  /// Its CURVE public key; empty without CURVE.
  [[nodiscard]] const std::string& key() const { return curve_key_; }
  /// ClientDirectory's number of its connection. Before it is shared.
  void note_client_number(std::uint64_t number) { client_number_ = number; }
  [[nodiscard]] std::uint64_t client_number() const { return client_number_; }
  [[nodiscard]] bool answered() const { return answered_.load(); }

 private:
  enum class Keep { kReply, kNothing };  // in the stored replies
  bool answer(proto::Reply reply, Keep keep);
  void stamp(proto::Reply& reply) const;
  bool refuse(const std::exception& fault, const std::string& prefix, Keep keep);
  /// In place of a reply that is too long for one message.
  std::string first_part(std::string whole);
  void deliver(std::string reply);
  void end();  // no client waits for it any more

  Transport& transport_;
  Counters& counters_;
  OpenRequests& open_;
  const std::string client_;  // its routing id
  const Way way_;
  const Role role_;
  const std::string curve_key_;
  Address address_;
  std::uint64_t id_;
  std::uint64_t client_number_ = 0;
  const std::string instance_;
  std::optional<unsigned> lasting_;  // its request changes something: OpenRequests::begin_lasting()
  const std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  StoredReplies* replies_ = nullptr;
  RequestKey key_;
  std::uint64_t hash_ = 0;
  ReplyParts* parts_ = nullptr;
  std::uint64_t most_bytes_ = 0;  // of a reply that goes whole
  std::atomic<bool> answered_{false};
};

using SharedTicket = std::shared_ptr<Ticket>;

}  // namespace limber::server
