#include "server/runtime/result_waiters.h"

#include <fmt/format.h>

#include "server/wire/errors.h"

namespace limber::server {

bool ResultWaiters::answers(const Noted& noted, std::uint64_t revision, Until until) {
  if (!noted.result || noted.result->revision() < revision) return false;
  if (until == Until::kFirst) return true;
  return noted.result->converged() && noted.storing == Storing::kDone &&
         (until == Until::kFinal || noted.check == Check::kDone);
}

void ResultWaiters::answer(Ticket& ticket, const proto::ResultInfo& result) const {
  proto::Reply reply;
  *reply.mutable_wait()->mutable_result() = result;
  ticket.answer(std::move(reply));
}

void ResultWaiters::wait(std::uint64_t revision, Until until, double timeout_s,
                         const SharedTicket& ticket) {
  const std::lock_guard lock(mutex_);
  for (const Noted& noted : {newest_, converged_, checked_}) {
    if (answers(noted, revision, until)) return answer(*ticket, *noted.result);
  }
  if (refusal_.code() != proto::ERROR_CODE_UNSPECIFIED) {
    proto::Reply reply;
    *reply.mutable_error() = refusal_;
    ticket->answer(std::move(reply));
    return;
  }
  waiters_.push_back(
      {revision, until, ticket,
       call_after(control_, timeout_s, [this, ticket, timeout_s] { late(ticket, timeout_s); })});
}

void ResultWaiters::note(const std::shared_ptr<const proto::ResultInfo>& result, Check check,
                         Storing storing) {
  const std::lock_guard lock(mutex_);
  const Noted noted{result, check, storing};
  const auto replace = [&](Noted& known) {
    if (!known.result || known.result->sequence() <= result->sequence()) known = noted;
  };
  replace(newest_);
  if (answers(noted, 0, Until::kFinal)) replace(converged_);
  if (answers(noted, 0, Until::kChecked)) replace(checked_);
  std::erase_if(waiters_, [&](const Waiter& waiter) {
    if (!answers(noted, waiter.revision, waiter.until)) return false;
    answer(*waiter.ticket, *result);
    return true;
  });
}

void ResultWaiters::late(const SharedTicket& ticket, double timeout_s) {
  const std::lock_guard lock(mutex_);
  ticket->refuse(Refusal(proto::ERROR_CODE_TIMEOUT, "timeout_s",
                         fmt::format("no such result within {} s", timeout_s)));
  std::erase_if(waiters_, [&](const Waiter& waiter) { return waiter.ticket == ticket; });
}

void ResultWaiters::refuse_all(const std::exception& fault, Later later) {
  const std::lock_guard lock(mutex_);
  for (auto& waiter : waiters_) waiter.ticket->refuse(fault);
  waiters_.clear();
  if (later == Later::kRefuse) refusal_ = error_to_proto(fault);
}

void ResultWaiters::abandon(const std::string& client) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiters_, [&](const Waiter& waiter) {
    if (waiter.ticket->client() != client) return false;
    waiter.ticket->abandon();
    return true;
  });
}

void ResultWaiters::accept() {
  const std::lock_guard lock(mutex_);
  refusal_.Clear();
}

std::size_t ResultWaiters::size() const {
  const std::lock_guard lock(mutex_);
  return waiters_.size();
}

}  // namespace limber::server
