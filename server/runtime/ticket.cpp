#include "server/runtime/ticket.h"

#include "server/log/log.h"
#include "server/wire/errors.h"

namespace limber::server {

Ticket::Ticket(Transport& transport, Counters& counters, OpenRequests& open, Address address,
               std::uint64_t id, std::string instance)
    : transport_(transport),
      counters_(counters),
      open_(open),
      client_(address.envelope.front()),
      way_(address.local_peer == 0 ? Way::kSocket : Way::kLocalPeer),
      role_(address.role),
      curve_key_(address.key),
      address_(std::move(address)),
      id_(id),
      instance_(std::move(instance)) {
  address_.request_id = id;
  open_.begin(client_);
}

Ticket::~Ticket() {
  if (!answered()) refuse(shutting_down());
}

bool Ticket::answer(proto::Reply reply) { return answer(std::move(reply), Keep::kReply); }

void Ticket::stamp(proto::Reply& reply) const {
  reply.set_version(1);
  reply.set_id(id_);
  reply.set_instance(instance_);
}

bool Ticket::answer(proto::Reply reply, Keep keep) {
  if (answered_.exchange(true)) return false;
  stamp(reply);
  // A wait that is not over after its time is asked again: nothing is wrong.
  if (reply.has_error() && reply.error().code() != proto::ERROR_CODE_TIMEOUT) {
    counters_.errors.fetch_add(1, std::memory_order_relaxed);
    if (reply.error().code() == proto::ERROR_CODE_INTERNAL)
      log::error(log::Fields{{"client", std::to_string(client_number_)}, {"error", "INTERNAL"}},
                 "internal fault: {}", reply.error().message());
  }
  if (reply.has_edit()) counters_.acknowledgements.note(std::chrono::steady_clock::now() - begun_);
  std::string bytes = reply.SerializeAsString();
  std::shared_ptr<Ticket> repeated;
  if (replies_ != nullptr) {
    repeated = keep == Keep::kReply ? replies_->answer(key_, bytes, StoredReplies::Clock::now())
                                    : replies_->forget(key_);
  }
  if (repeated) repeated->answer_again(bytes);
  if (parts_ != nullptr && bytes.size() > most_bytes_ && !reply.has_error())
    bytes = first_part(std::move(bytes));
  deliver(std::move(bytes));
  return true;
}

void Ticket::divide_reply(ReplyParts& parts, std::uint64_t most_bytes) {
  parts_ = &parts;
  most_bytes_ = most_bytes;
}

std::string Ticket::first_part(std::string whole) {
  auto unread = transport_.hold_kept(client_, whole.size());
  if (!unread) return whole;
  proto::Reply reply;
  stamp(reply);
  *reply.mutable_get_reply_part() = parts_->begin(client_, std::move(whole), std::move(*unread),
                                                  most_bytes_, ReplyParts::Clock::now());
  return reply.SerializeAsString();
}

void Ticket::deliver(std::string reply) {
  open_.answered(client_);
  transport_.send(std::move(address_), std::move(reply));
  end();
}

void Ticket::note_lasting() { lasting_ = open_.begin_lasting(); }

void Ticket::end() {
  open_.end();
  if (lasting_) open_.end_lasting(*lasting_);
}

void Ticket::keep_reply(StoredReplies& replies, RequestKey key, std::uint64_t hash) {
  replies_ = &replies;
  key_ = std::move(key);
  hash_ = hash;
}

void Ticket::answer_again(std::string reply) {
  if (answered_.exchange(true)) return;
  deliver(std::move(reply));
}

std::shared_ptr<Ticket> Ticket::abandon() {
  if (answered_.exchange(true)) return nullptr;
  counters_.dropped_replies.fetch_add(1, std::memory_order_relaxed);
  open_.answered(client_);
  end();
  if (replies_ == nullptr) return nullptr;
  auto heir = replies_->abandon(key_);
  if (heir) heir->keep_reply(*replies_, key_, hash_);
  return heir;
}

void Ticket::absorb() {
  if (answered_.exchange(true)) return;
  open_.answered(client_);
  end();
}

bool Ticket::refuse(const std::exception& fault, const std::string& prefix) {
  return refuse(fault, prefix, Keep::kReply);
}

bool Ticket::refuse_unbegun(const std::exception& fault) {
  return refuse(fault, "", Keep::kNothing);
}

bool Ticket::refuse(const std::exception& fault, const std::string& prefix, Keep keep) {
  proto::Reply reply;
  *reply.mutable_error() = error_to_proto(fault, prefix);
  log::debug(log::Fields{{"client", std::to_string(client_number_)},
                         {"error", proto::ErrorCode_Name(reply.error().code())},
                         {"field", reply.error().field()}},
             "request {} refused: {} {}: {}", id_, proto::ErrorCode_Name(reply.error().code()),
             reply.error().field(), reply.error().message());
  return answer(std::move(reply), keep);
}

}  // namespace limber::server
