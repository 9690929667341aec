#include "server/service/kept_sessions.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <type_traits>
#include <utility>

#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/gated_executor.h"
#include "server/wire/edits.h"
#include "server/wire/errors.h"
#include "server/wire/readable.h"

namespace limber::server {
namespace {

/// Results that may have been published after the stored one: two hours of iterates.
constexpr std::uint64_t kSequencesAhead = 1'000'000;

/// @param defaults  fields that the scene is stored with besides its own
store::OpenedSession opened_session(const Record& record, const proto::Scene& scene,
                                    const proto::Scene& defaults) {
  std::string bytes = scene.SerializeAsString();
  defaults.AppendToString(&bytes);  // messages behind one another are read as one
  return {record.key().uid, record.id(), record.kind(), std::move(bytes),
          record.status().SerializeAsString()};
}

/// For a session of this store: earlier limits may have been wider, and open sessions stay. It may
/// have as many constraints as it ever had.
SceneContext context_of_stored(SceneContext context, const proto::StoredSession& stored) {
  const auto widen = [](auto& limit, std::uint64_t most) {
    using Number = std::decay_t<decltype(+limit)>;
    if (limit < most) limit = static_cast<Number>(most);
  };
  widen(context.limits.mesh_tets, std::numeric_limits<std::uint64_t>::max());
  widen(context.limits.frames, std::numeric_limits<std::uint32_t>::max());
  int constraints = std::max(stored.scene().constraints_size(),
                             stored.checkpoint().body().scene().constraints_size());
  for (const auto& edit : stored.edits()) constraints += edit.edits_size();
  widen(context.limits.constraints, static_cast<std::uint64_t>(constraints));
  return context;
}

/// Not of the session: it may come back when there is room.
bool is_of_limits(const std::exception& fault) {
  const auto* const refusal = dynamic_cast<const Refusal*>(&fault);
  return refusal != nullptr && refusal->code() == proto::ERROR_CODE_LIMIT_EXCEEDED;
}

/// @throws Error{kIo, "session"}
[[noreturn]] void fail_to_bring_back(const SessionKey& key, const std::exception& why) {
  log::warn(log::Fields{{"session", key.name}}, "session {} could not be brought back: {}",
            key.name, why.what());
  throw Error(ErrorCode::kIo, "session",
              fmt::format("session '{}' is stored and could not be brought back: {}", key.name,
                          why.what()));
}

}  // namespace

void KeptSessions::recall(StoredReplies& replies) {
  if (!is_on()) return;
  runs_ = hub_.store->begin_run(hub_.run.instance);
  const auto heads = hub_.store->heads();
  for (const auto& head : heads) {
    // A damaged name is listed as far as it can be read.
    const std::string name = readable(head.name);
    SessionRegistry::Parked parked{{name, head.uid}, {}};
    // Unreadable statuses are left out of a list.
    if (!parked.status.ParseFromString(head.status)) parked.status.Clear();
    parked.status.set_session(name);
    parked.status.set_uid(head.uid);
    parked.status.set_kind(readable(head.kind));
    parked.status.set_revision(head.revision);
    parked.status.set_state(proto::SESSION_STATE_PARKED);
    parked.status.set_is_stored(true);
    parked.status.clear_progress();
    parked.status.clear_memory_bytes();
    parked.status.clear_clients();
    parked.status.clear_revisions();
    parked.status.clear_age_s();
    sessions_.park(std::move(parked));
  }
  if (!heads.empty()) log::info("{} sessions are in {}", heads.size(), hub_.store->file().string());
  for (auto& kept : hub_.store->replies(store::kReplySeconds)) {
    proto::Reply reply;
    if (kept.reply.empty() || !reply.ParseFromString(kept.reply)) {
      // Recalled nevertheless: finished requests must not be repeated.
      reply.Clear();
      reply.set_version(1);
      reply.set_id(kept.id);
      *reply.mutable_error() = error_to_proto(
          Error(ErrorCode::kIo, "id", "the request was done, and its stored reply is damaged"));
    }
    reply.set_instance(hub_.run.instance);
    replies.recall({kept.client, kept.id}, kept.hash, reply.SerializeAsString(),
                   StoredReplies::Clock::now());
  }
}

void KeptSessions::demand_writable() const {
  if (!is_on()) return;
  const std::string fault = hub_.store->fault();
  if (!fault.empty())
    throw Error(ErrorCode::kIo, "",
                fmt::format("nothing was changed, since changes cannot be stored now: {}", fault));
}

void KeptSessions::write(const SharedTicket& ticket, std::vector<store::Change> changes,
                         proto::Reply reply, std::function<void()> undo) {
  if (const RequestKey& key = ticket->request_key(); key.id != 0 && !is_of_connection(key)) {
    reply.set_version(1);
    reply.set_id(key.id);
    changes.emplace_back(
        store::KeptReply{key.client, key.id, ticket->request_hash(), reply.SerializeAsString()});
  }
  const auto keep = undo ? store::Store::Keep::kNotAtAll : store::Store::Keep::kUntilWritten;
  auto done = [ticket, reply = std::move(reply),
               undo = std::move(undo)](const std::exception_ptr& fault) {
    if (!fault) {
      ticket->answer(reply);
      return;
    }
    if (undo) undo();
    try {
      std::rethrow_exception(fault);
    } catch (const std::exception& why) {
      ticket->refuse(why);
    }
  };
  hub_.store->append(std::move(changes), std::move(done), keep);
}

void KeptSessions::opened(const SharedTicket& ticket, const std::shared_ptr<Record>& record,
                          const proto::Scene& scene, proto::Reply reply,
                          std::function<void()> undo) {
  write(ticket, {opened_session(*record, scene, kinds_.of(scene, "scene").defaults_of(scene))},
        std::move(reply), std::move(undo));
  record->begin_to_store_answers();
}

void KeptSessions::edited(const SharedTicket& ticket, Record& record, std::uint64_t revision,
                          const proto::EditRequest& made, const std::string& name,
                          const session::Author& author, proto::Reply reply) {
  // The name of a connection is of bytes that no message can be read with.
  const RequestKey& key = ticket->request_key();
  const std::string client = is_of_connection(key) ? std::string() : key.client;
  write(ticket, record.changes_of(revision, made, {client, name, author}), std::move(reply));
  checkpoints_.note_edit(record);
}

void KeptSessions::closed(const SharedTicket& ticket, std::uint64_t uid, proto::Reply reply) {
  write(ticket, {store::ClosedSession{uid}}, std::move(reply));
}

void KeptSessions::imported(const SharedTicket& ticket, Record& record,
                            const proto::StoredSession& stored, proto::Reply reply,
                            std::function<void()> undo) {
  const std::uint64_t uid = record.key().uid;
  std::vector<store::Change> changes{opened_session(record, stored.scene(), {})};
  if (stored.has_checkpoint())
    changes.emplace_back(store::SavedCheckpoint{uid, stored.checkpoint().revision(),
                                                stored.checkpoint().SerializeAsString()});
  for (const auto& edit : stored.edits())
    changes.emplace_back(store::EditedSession{uid, edit.revision(), edit.SerializeAsString()});
  write(ticket, std::move(changes), std::move(reply), std::move(undo));
  if (stored.has_answer()) hub_.store->keep_answer(uid, {stored.answer().SerializeAsString(), {}});
  record.begin_to_store_answers();
}

std::shared_ptr<Record> KeptSessions::find(const std::string& reference) {
  (void)SessionKey::parse(reference);
  while (const auto parked = sessions_.parked(reference)) {
    std::unique_lock lock(mutex_);
    if (!coming_.insert(parked->key.name).second) {
      brought_back_.wait(lock);
      continue;
    }
    lock.unlock();
    const auto leave = [&] {
      const std::lock_guard again(mutex_);
      coming_.erase(parked->key.name);
      brought_back_.notify_all();
    };
    try {
      bring_back(*parked);
    } catch (...) {
      leave();
      throw;
    }
    leave();
  }
  return sessions_.find(reference);
}

void KeptSessions::bring_back(const SessionRegistry::Parked& parked) {
  // Another thread was quicker.
  if (!sessions_.parked(parked.key.reference())) return;
  const auto begin = std::chrono::steady_clock::now();
  try {
    proto::StoredSession stored = hub_.store->load(parked.key.uid);
    // Clients drop results with numbers that they had, whether or not the answer is there.
    auto& answer = *stored.mutable_answer();
    answer.set_sequence(std::max(answer.sequence(), parked.status.result().sequence()));
    const auto try_to = [&] {
      restore(parked.key, stored, context_of_stored(scenes_, stored), parked.people)
          .record->begin_to_store_answers();
    };
    try {
      try_to();
    } catch (const std::exception& fault) {
      if (!answer.has_start() || is_of_limits(fault)) throw;
      const std::exception_ptr first = std::current_exception();
      const std::string why = fault.what();
      answer.clear_start();
      try {
        try_to();
      } catch (...) {
        std::rethrow_exception(first);
      }
      log::warn(log::Fields{{"session", parked.key.name}},
                "session {} could not begin in its stored answer ({}): its edits are solved again",
                parked.key.name, why);
    }
  } catch (const Refusal& refusal) {
    if (is_of_limits(refusal)) throw;
    fail_to_bring_back(parked.key, refusal);
  } catch (const Error& fault) {
    fail_to_bring_back(parked.key, fault);
  }
  hub_.counters.brought_back.fetch_add(1, std::memory_order_relaxed);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  log::info(log::Fields{{"session", parked.key.name}}, "session {} is back after {:.1f} ms",
            parked.key.name, took.count());
}

KeptSessions::Restored KeptSessions::restore(const SessionKey& key,
                                             const proto::StoredSession& stored,
                                             const SceneContext& scenes,
                                             const std::shared_ptr<Attendance>& people) {
  const Kind& kind = kinds_.of(stored.scene(), "scene");
  proto::Scene scene = stored.scene();
  kind.add_older_defaults(scene);
  if (stored.answer().has_start()) kind.begin_in(scene, stored.answer().start());
  const std::unique_ptr<Opening> opening = kind.read(scene, scenes);
  const auto room = parking_.make_room(opening->memory());
  const JobId job = start_open_job(key);
  JobGuard guard(hub_.jobs, job);
  auto record = opening->make_record(hub_, key, job);
  record->set_memory(opening->memory());
  record->expect_answer(stored.answer().result());
  if (stored.has_answer()) record->continue_after(stored.answer().sequence() + kSequencesAhead);
  std::unique_lock order(record->edit_order());
  // The first solve finds all edits made.
  GatedExecutor gate(hub_.session_executor("returning"));  // before a client's second build
  try {
    opening->start(hub_, gate.executor());
    std::uint64_t revision = 0;
    if (stored.has_checkpoint()) {
      record->begin_at(stored.checkpoint());
      revision = stored.checkpoint().revision();
      record->stored_edits().note_checkpoint(stored.checkpoint().ByteSizeLong(), 0, 0);
    }
    for (const auto& edit : stored.edits()) {
      proto::EditRequest request;
      request.set_session(key.reference());
      *request.mutable_edits() = edit.edits();
      if (record->edit(request, edit.author()).revision() != edit.revision())
        throw Error(ErrorCode::kIo, "session",
                    fmt::format("edit {} is missing in what is stored", edit.revision()));
      revision = edit.revision();
      record->stored_edits().note_edit(edit.ByteSizeLong());
    }
    record->note_stored(revision);
    if (people)
      record->continue_with(people);
    else
      recall_makers(*record, stored);
    put(record);
  } catch (const std::exception& fault) {
    order.unlock();
    gate.open();
    try {
      record->close();
    } catch (const std::exception&) {  // it was not even made
    }
    guard.fail(fault);
    throw;
  }
  guard.release();
  gate.open();
  return {std::move(record), std::move(order)};
}

/// Who made the newest revisions.
void KeptSessions::recall_makers(Record& record, const proto::StoredSession& stored) {
  const auto now = Attendance::Clock::now();
  const auto now_ms = milliseconds_since_1970();
  record.attendance().recall(stored.checkpoint().makers(), now, now_ms);
  constexpr int kEdits = 1000;  // that may be one run of one client
  for (int i = std::max(0, stored.edits_size() - kEdits); i < stored.edits_size(); ++i) {
    const proto::StoredEdit& edit = stored.edits(i);
    const std::string& name = edit.client_name().empty() ? edit.client() : edit.client_name();
    if (name.empty()) continue;
    const std::chrono::milliseconds age(now_ms > edit.at_ms() ? now_ms - edit.at_ms() : 0);
    proto::EditRequest request;
    *request.mutable_edits() = edit.edits();
    record.attendance().note_revision({0, name}, edit.revision(), kinds_of_edits(request),
                                      now - age);
  }
}

JobId KeptSessions::start_open_job(const SessionKey& key) {
  const auto cancel = [this, reference = key.reference()] {
    try {
      sessions_.find(reference)->cancel();
    } catch (const std::exception& fault) {
      log::debug("cancelling {}: {}", reference, fault.what());
    }
  };
  // Bounded by memory: jobs of one client are not to keep another from opening.
  return hub_.jobs.start("open_session", key.name, cancel, JobRegistry::Limit::kNone);
}

void KeptSessions::put(const std::shared_ptr<Record>& record) {
  for (const auto& failed : sessions_.put(record)) give_way(*failed);
}

void KeptSessions::give_way(Record& record) {
  try {
    record.close();
    log::info(log::Fields{{"session", record.id()}}, "session {} gave its place to another",
              record.id());
  } catch (const std::exception& fault) {  // a client was quicker
    log::debug("closing {}: {}", record.id(), fault.what());
  }
  if (is_on()) hub_.store->append({store::ClosedSession{record.key().uid}}, nullptr);
}

proto::StoredSession KeptSessions::load(const std::string& reference) {
  const auto parked = sessions_.parked(reference);
  const std::uint64_t uid = parked ? parked->key.uid : sessions_.find(reference)->key().uid;
  hub_.store->flush();
  return hub_.store->load(uid);
}

}  // namespace limber::server
