#include "server/store/store.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <set>
#include <utility>
#include <variant>

#include "engine/base/error.h"
#include "server/log/log.h"
#include "server/store/row_seal.h"
#include "server/store/session_rows.h"
#include "server/store/store_file.h"
#include "server/store/writer.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;

StoreOptions validated(StoreOptions options) {
  options.validate();
  return options;
}

std::exception_ptr not_written(const std::string& fault, Store::Keep keep) {
  const char* const what =
      keep == Store::Keep::kNotAtAll
          ? "nothing was opened, since it could not be stored"
          : "the change is made, but it could not be stored, and would be lost with the server";
  return std::make_exception_ptr(Error(ErrorCode::kIo, "", fmt::format("{}: {}", what, fault)));
}

/// Changes that its session would miss: replies and runs are of no session.
bool is_of_session(const Change& change) {
  return !std::holds_alternative<KeptReply>(change) && !std::holds_alternative<StartedRun>(change);
}

void seal(OpenedSession& opened) {
  add_seal(opened.status, place_of("sessions", opened.uid));
  // The scene has no seal of its own: exports contain it unchanged, and older servers import no
  // scene with an unknown field.
  opened.seal = seal_of({opened.name, opened.kind, opened.scene});
}
void seal(EditedSession& edited) {
  add_seal(edited.edit, place_of("edits", edited.uid, edited.revision));
}
void seal(SavedCheckpoint& saved) {
  add_seal(saved.checkpoint, place_of("checkpoints", saved.uid, saved.revision));
}
void seal(KeptReply& kept) { add_seal(kept.reply, place_of_reply(kept.client, kept.id)); }
void seal(const ClosedSession& /*has nothing*/) {}
void seal(const StartedRun& /*has nothing*/) {}

/// Of each session the newest.
void add_newest(SavedCheckpoint checkpoint, std::map<std::uint64_t, SavedCheckpoint>& to) {
  const auto [known, is_new] = to.try_emplace(checkpoint.uid);
  if (is_new || known->second.revision < checkpoint.revision) known->second = std::move(checkpoint);
}

/// To which more room on the disk is no help.
bool is_no_matter_of_room(const std::exception& fault) {
  return dynamic_cast<const DamagedFile*>(&fault) != nullptr ||
         dynamic_cast<const LockedFile*>(&fault) != nullptr ||
         dynamic_cast<const WriterHasEnded*>(&fault) != nullptr;
}

/// Reads a consistent state, even if others write meanwhile.
class Reading {
 public:
  explicit Reading(Database& database) : database_(database) { database_.run("BEGIN"); }
  ~Reading() { database_.roll_back(); }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

 private:
  Database& database_;
};

}  // namespace

Store::Store(StoreOptions options)
    : options_(validated(std::move(options))), lock_(options_), reserve_(options_.reserve()) {
  prepare_store_file(options_);
  open_writer();
  reader_.emplace(options_.file(), Database::Access::kRead);
  reserve_.restore();
  thread_ = std::thread([this] { write_all(); });
}

Store::~Store() { end(); }

/// A full disk is no reason not to start: stored sessions can be read and removed.
void Store::open_writer() {
  try {
    writer_ = std::make_unique<Writer>(options_);
  } catch (const Error& fault) {  // the index of the log takes some room, too
    if (is_no_matter_of_room(fault) || fault.code() != ErrorCode::kIo || !reserve_.give_up()) throw;
    writer_ = std::make_unique<Writer>(options_);
  }
  const auto try_to = [this](void (Writer::*forget)()) {
    try {
      (writer_.get()->*forget)();
      return true;
    } catch (const std::exception& fault) {
      log::warn("what is too old stays in the store: {}", fault.what());
      return is_no_matter_of_room(fault);
    }
  };
  if (!try_to(&Writer::forget_unchanged) && reserve_.give_up())
    (void)try_to(&Writer::forget_unchanged);
  (void)try_to(&Writer::forget_old);
}

std::size_t Store::end() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  return lost_;
}

fs::path Store::file() const { return options_.file(); }

void Store::append(std::vector<Change> changes, Done done, Keep keep) {
  // Here, since others wait for the thread that writes.
  for (Change& change : changes) std::visit([](auto& one) { seal(one); }, change);
  bool is_late = false;
  {
    const std::lock_guard lock(mutex_);
    is_late = is_ending_;
    if (!is_late) waiting_.batches.push_back({std::move(changes), std::move(done), keep});
  }
  if (is_late && done) done(not_written("the server ends", keep));
  changed_.notify_all();
}

void Store::keep_answer(std::uint64_t uid, KeptAnswer answer, Done done) {
  add_seal(answer.answer, place_of("answers", uid));
  if (!answer.status.empty()) add_seal(answer.status, place_of("statuses", uid));
  std::string fault;
  {
    const std::lock_guard lock(mutex_);
    fault = is_ending_ ? "the server ends" : fault_;
    if (!is_ending_) {
      WaitingAnswer& waiting = waiting_.answers[uid];
      waiting.newest = std::move(answer);
      if (done && fault.empty()) waiting.done.push_back(std::exchange(done, nullptr));
    }
  }
  if (done) done(not_written(fault, Keep::kUntilWritten));
  changed_.notify_all();
}

void Store::keep_checkpoint(SavedCheckpoint checkpoint) {
  seal(checkpoint);
  {
    const std::lock_guard lock(mutex_);
    add_newest(std::move(checkpoint), waiting_.checkpoints);
  }
  changed_.notify_all();
}

void Store::flush() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] {
    const bool is_idle = waiting_.batches.empty() && waiting_.answers.empty() &&
                         waiting_.checkpoints.empty() && !is_writing_;
    return is_idle || !fault_.empty();
  });
}

/// Changes stay in `work` until they are written; waiting callers are notified once.
void Store::write_all() {
  Work work;
  bool has_made_room = false;
  std::unique_lock lock(mutex_);
  while (true) {
    const auto has_news = [this] {
      return is_ending_ || !waiting_.batches.empty() || !waiting_.answers.empty() ||
             !waiting_.checkpoints.empty();
    };
    const bool is_behind = !work.batches.empty() || !work.answers.empty();
    if (!is_behind) {
      while (writer_->has_superseded()) {  // a few, then newly arrived changes
        lock.unlock();
        const bool is_held = !forget_superseded();
        lock.lock();
        if (is_held || has_news()) break;
      }
      changed_.wait(lock, has_news);
    } else if (!is_ending_ && !has_made_room) {
      changed_.wait_for(lock, options_.retry, [this] { return is_ending_; });
    }
    take_waiting(work);
    if (work.batches.empty() && work.answers.empty() && work.checkpoints.empty()) {
      if (is_ending_) return;
      continue;
    }
    const bool is_last = is_ending_;
    is_writing_ = true;
    lock.unlock();
    const auto [fault, may_room_help] = try_to_write(work);
    if (!fault.empty()) {  // changes that came meanwhile must not wait for the next attempt
      lock.lock();
      take_waiting(work);
      lock.unlock();
    }
    const auto outcome = [&why = fault](Keep keep) {
      return why.empty() ? nullptr : not_written(why, keep);
    };
    const std::vector<Done> answered = take_answer_callbacks(work);
    has_made_room = may_room_help && make_room(work);
    for (Batch& batch : work.batches) {
      if (const Done done = std::exchange(batch.done, nullptr)) {
        done(outcome(batch.keep));
      }
    }
    for (const Done& done : answered) done(outcome(Keep::kUntilWritten));
    if (fault.empty()) {
      keep_house(work);
      if (is_last) work = {};  // the edits that a checkpoint replaces are stored
      reserve_.restore();
    } else {
      std::erase_if(work.batches, [](const Batch& batch) { return batch.keep == Keep::kNotAtAll; });
    }
    lock.lock();
    is_writing_ = false;
    idle_.notify_all();
    if (!fault.empty() && is_last && !has_made_room) {
      for (const Batch& batch : work.batches)
        lost_ += static_cast<std::size_t>(
            std::count_if(batch.changes.begin(), batch.changes.end(), is_of_session));
      if (lost_ > 0) log::error("{} changes of sessions are lost: {}", lost_, fault);
      return;
    }
  }
}

/// With the lock.
void Store::take_waiting(Work& work) {
  for (Batch& batch : waiting_.batches) work.batches.push_back(std::move(batch));
  waiting_.batches.clear();
  for (auto& [uid, answer] : waiting_.answers) {
    WaitingAnswer& behind = work.answers[uid];
    behind.newest = std::move(answer.newest);
    std::move(answer.done.begin(), answer.done.end(), std::back_inserter(behind.done));
  }
  waiting_.answers.clear();
  for (auto& [uid, checkpoint] : waiting_.checkpoints)
    add_newest(std::move(checkpoint), work.checkpoints);
  waiting_.checkpoints.clear();
}

std::size_t Store::count_of(const Work& work) {
  std::size_t changes = work.answers.size();
  for (const Batch& batch : work.batches) changes += batch.changes.size();
  return changes;
}

std::vector<Store::Done> Store::take_answer_callbacks(Work& work) {
  std::vector<Done> all;
  for (auto& [uid, answer] : work.answers) {
    for (Done& done : answer.done) all.push_back(std::move(done));
    answer.done.clear();
  }
  return all;
}

/// Changes and answers, in one transaction. Faults, and their end, are noted before callers get
/// them: later refusals give this reason.
void Store::write(const Work& work) {
  if (work.batches.empty() && work.answers.empty()) return;
  writer_->begin();
  for (const Batch& batch : work.batches) {
    for (const Change& change : batch.changes) writer_->write(change);
  }
  for (const auto& [uid, answer] : work.answers) writer_->write_answer(uid, answer.newest);
  writer_->commit();
  note_written(count_of(work));
}

Store::Outcome Store::try_to_write(const Work& work) {
  const auto attempt = [&]() -> Outcome {
    try {
      write(work);
      return {};
    } catch (const std::exception& error) {
      writer_->roll_back();
      return {error.what(), !is_no_matter_of_room(error)};
    }
  };
  Outcome outcome = attempt();
  if (outcome.may_room_help) {
    writer_->give_back();  // what the log held may be room enough
    outcome = attempt();
  }
  if (!outcome.fault.empty()) note_fault(outcome.fault);
  return outcome;
}

/// Work without waiting callers. It waits for no lock either: an edit that comes meanwhile would
/// wait for it, and then for its own.
void Store::keep_house(Work& work) {
  work.batches.clear();
  work.answers.clear();
  const auto no_wait = writer_->without_waiting();
  if (write_checkpoints(work)) forget_now_and_then();
}

/// Written data stay written, whether or not room is made after them.
void Store::forget_now_and_then() {
  try {
    writer_->forget_now_and_then();
  } catch (const std::exception& fault) {
    log::warn("old replies stay in the store: {}", fault.what());
  }
}

/// After the edits that they replace, and after the answers to their authors.
bool Store::write_checkpoints(Work& work) {
  if (work.checkpoints.empty()) return true;
  try {
    writer_->begin();
    for (const auto& [uid, checkpoint] : work.checkpoints) writer_->write(checkpoint);
    writer_->commit();
    note_written(0);
  } catch (const LockedFile& fault) {
    writer_->roll_back();
    log::debug("checkpoints wait: {}", fault.what());
    return false;
  } catch (const std::exception& fault) {
    writer_->roll_back();
    log::warn("edits of sessions stay in the store, no checkpoint could be written: {}",
              fault.what());
  }
  work.checkpoints.clear();
  return true;
}

bool Store::forget_superseded() {
  const auto no_wait = writer_->without_waiting();
  try {
    writer_->forget_superseded();
  } catch (const LockedFile& fault) {
    log::debug("edits that a checkpoint stands for wait: {}", fault.what());
    return false;
  } catch (const std::exception& fault) {
    log::warn("edits that a checkpoint stands for stay in the store: {}", fault.what());
    writer_->leave_superseded();
  }
  return true;
}

bool Store::make_room(Work& work) {
  std::set<std::uint64_t> closed;
  std::vector<KeptReply> replies;
  const auto closes = [](const Batch& batch) {
    return std::any_of(batch.changes.begin(), batch.changes.end(), [](const Change& change) {
      return std::holds_alternative<ClosedSession>(change);
    });
  };
  for (const Batch& batch : work.batches) {
    if (!closes(batch)) continue;
    for (const Change& change : batch.changes) {
      if (const auto* one = std::get_if<ClosedSession>(&change)) closed.insert(one->uid);
      if (const auto* reply = std::get_if<KeptReply>(&change)) replies.push_back(*reply);
    }
  }
  if (closed.empty() || !remove(closed, replies)) return false;
  const auto is_gone = [&](const Change& change) {
    const auto* edited = std::get_if<EditedSession>(&change);
    const auto* opened = std::get_if<OpenedSession>(&change);
    return (edited != nullptr && closed.contains(edited->uid)) ||
           (opened != nullptr && closed.contains(opened->uid));
  };
  for (Batch& batch : work.batches) {
    if (closes(batch)) {
      batch.changes.clear();
      if (const Done done = std::exchange(batch.done, nullptr)) done(nullptr);
    } else {
      std::erase_if(batch.changes, is_gone);
    }
  }
  for (const std::uint64_t uid : closed) work.answers.erase(uid);
  return true;
}

bool Store::remove(const std::set<std::uint64_t>& uids, const std::vector<KeptReply>& replies) {
  do {
    try {
      writer_->make_room(uids, replies);
      return true;
    } catch (const std::exception& fault) {
      log::debug("not even that can be written: {}", fault.what());
      if (is_no_matter_of_room(fault)) return false;
    }
  } while (reserve_.give_up());
  return false;
}

void Store::note_written(std::size_t changes) {
  note_log();
  const std::lock_guard lock(mutex_);
  ++commits_;
  changes_ += changes;
  if (fault_.empty()) return;
  log::info("the store can be written again");
  fault_.clear();
}

/// SQLite folds the log after a commit. If it could not, a reader prevented it, since the reads of
/// this server are short.
void Store::note_log() {
  const auto index = writer_->log_index();
  const bool is_held = index && index->unfolded_bytes() > kUnfoldedBytes;
  const std::lock_guard lock(mutex_);
  if (is_held == !warning_.empty()) return;
  if (is_held) {
    warning_ = fmt::format(
        "the log {} grows without bound: another process reads the store in a transaction that "
        "does "
        "not end, and it cannot be folded meanwhile",
        options_.log().string());
    log::warn("{}", warning_);
  } else {
    warning_.clear();
    log::info("the log of the store is folded again");
  }
}

void Store::note_fault(const std::string& fault) {
  const std::lock_guard lock(mutex_);
  if (fault != fault_)
    log::error(log::Fields{{"error", fault}}, "changes of sessions cannot be stored: {}", fault);
  fault_ = fault;
}

std::string Store::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

std::string Store::warning() const {
  const std::lock_guard lock(mutex_);
  return warning_;
}

std::vector<StoredHead> Store::heads() {
  const std::lock_guard lock(reading_);
  std::vector<StoredHead> heads;
  auto rows = reader_->prepare(
      "SELECT uid, revision, name, kind, sessions.status, touched, statuses.status"
      " FROM sessions LEFT JOIN statuses USING(uid) ORDER BY touched");
  while (rows.step()) {
    StoredHead head{rows.number(0), rows.number(1), rows.bytes(2), rows.bytes(3), {},
                    rows.number(5)};
    /// Empty where there is none, or it is damaged.
    const auto status_in = [&](int column, const char* table) {
      std::string status = rows.bytes(column);
      if (take_seal(status, place_of(table, head.uid)) != Seal::kWrong) return status;
      log::warn(log::Fields{{"session", head.name}},
                "the stored state of session {} is damaged: lists show an older one", head.name);
      return std::string();
    };
    head.status = status_in(6, "statuses");
    if (head.status.empty()) head.status = status_in(4, "sessions");
    heads.push_back(std::move(head));
  }
  return heads;
}

proto::StoredSession Store::load(std::uint64_t uid) {
  const std::lock_guard lock(reading_);
  const Reading all_at_once(*reader_);
  return read_session(*reader_, uid);
}

std::set<std::string> Store::begin_run(const std::string& instance) {
  append({StartedRun{instance}}, nullptr);
  flush();
  const std::lock_guard lock(reading_);
  std::set<std::string> before;
  auto rows = reader_->prepare("SELECT instance FROM runs WHERE instance != ?");
  rows.bind_text(instance);
  while (rows.step()) before.insert(rows.bytes(0));
  return before;
}

std::vector<KeptReply> Store::replies(std::uint64_t seconds) {
  const std::lock_guard lock(reading_);
  std::vector<KeptReply> replies;
  auto rows = reader_->prepare(
      "SELECT client, id, hash, reply FROM replies WHERE at >= strftime('%s', 'now') - ? ORDER BY "
      "at");
  rows.bind(seconds);
  while (rows.step()) {
    KeptReply kept{rows.bytes(0), rows.number(1), rows.number(2), rows.bytes(3)};
    if (take_seal(kept.reply, place_of_reply(kept.client, kept.id)) == Seal::kWrong) {
      log::warn("the stored reply to request {} of client {} is damaged", kept.id, kept.client);
      kept.reply.clear();
    }
    replies.push_back(std::move(kept));
  }
  return replies;
}

Store::Counts Store::counts() const {
  const std::uint64_t log_bytes = length_of(options_.log());
  const std::uint64_t bytes = length_of(options_.file()) + log_bytes;
  const std::lock_guard lock(mutex_);
  return {bytes, log_bytes, commits_, changes_,
          options_.durability == Durability::kPower ? commits_ : 0};
}

}  // namespace limber::server::store
