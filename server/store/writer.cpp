#include "server/store/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "limber/v1/stored.pb.h"
#include "server/log/log.h"
#include "server/store/log_check.h"
#include "server/store/row_seal.h"

namespace limber::server::store {
namespace {

namespace proto = limber::v1;

// Version of the tables. 1: all edits of a session are there; 2: there are checkpoints, which
// servers that know version 1 alone must not ignore.
constexpr std::uint64_t kFirstForm = 1, kForm = 2;
/// That are removed in one transaction where there is no room: less than a megabyte of log.
constexpr std::uint64_t kFewEdits = 128;
/// A revision behind all others, and an integer of SQLite.
constexpr std::uint64_t kLastRevision = std::numeric_limits<std::int64_t>::max();

std::uint64_t now_s() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::seconds>(since).count());
}

/// During its lifetime, removed data are not overwritten if that would write more, and the log is
/// not folded automatically.
class Sparing {
 public:
  explicit Sparing(Database& database) : database_(database) {
    try {
      auto mode = database_.prepare("PRAGMA secure_delete");
      before_ = mode.step() ? mode.number(0) : 0;
    } catch (const std::exception& fault) {
      log::debug("secure_delete: {}", fault.what());
    }
    set(kFast, 0);
  }
  ~Sparing() { set(before_, kPagesOfLog); }
  Sparing(const Sparing&) = delete;
  Sparing& operator=(const Sparing&) = delete;

 private:
  static constexpr std::uint64_t kFast = 2;  // of SQLite: 0 off, 1 on, 2 fast
  static constexpr int kPagesOfLog = 1000;   // at which SQLite folds it, by default

  void set(std::uint64_t mode, int pages) noexcept {
    try {
      const char* const name = mode == kFast ? "FAST" : mode == 0 ? "OFF" : "ON";
      database_.run(
          fmt::format("PRAGMA secure_delete = {}; PRAGMA wal_autocheckpoint = {}", name, pages)
              .c_str());
    } catch (const std::exception& fault) {
      log::debug("secure_delete: {}", fault.what());
    }
  }

  Database& database_;
  std::uint64_t before_ = kFast;
};

}  // namespace

Writer::Writer(const StoreOptions& options)
    : options_(options), database_(options.file(), Database::Access::kWrite), files_(options) {
  check_is_limber_store();
  check_structure();
  if (damage_.empty()) check_log();
  // Before the file has pages. With pages, this would be a change, for which there may be no room.
  const auto vacuums = [this] {
    auto mode = database_.prepare("PRAGMA auto_vacuum");
    return mode.step() && mode.number(0) != 0;
  };
  if (!vacuums()) database_.run("PRAGMA auto_vacuum = INCREMENTAL");
  database_.run("PRAGMA journal_mode = WAL");
  database_.run(options.durability == Durability::kPower ? "PRAGMA synchronous = FULL"
                                                         : "PRAGMA synchronous = NORMAL");
  database_.run(fmt::format("PRAGMA journal_size_limit = {}", kLogBytes).c_str());
  if (options.bytes > 0) {
    auto size = database_.prepare("PRAGMA page_size");
    if (size.step())
      database_.run(
          fmt::format("PRAGMA max_page_count = {}", options.bytes / size.number(0) + 1).c_str());
  }
  database_.run(
      "BEGIN IMMEDIATE;"
      "CREATE TABLE IF NOT EXISTS form(version INTEGER NOT NULL);"
      "CREATE TABLE IF NOT EXISTS sessions(uid INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE,"
      " kind TEXT NOT NULL, scene BLOB NOT NULL, status BLOB NOT NULL, revision INTEGER NOT NULL,"
      " touched INTEGER NOT NULL);"
      "CREATE TABLE IF NOT EXISTS edits(uid INTEGER NOT NULL, revision INTEGER NOT NULL,"
      " edit BLOB NOT NULL, PRIMARY KEY(uid, revision)) WITHOUT ROWID;"
      "CREATE TABLE IF NOT EXISTS answers(uid INTEGER PRIMARY KEY, answer BLOB NOT NULL);"
      "CREATE TABLE IF NOT EXISTS checkpoints(uid INTEGER PRIMARY KEY, revision INTEGER NOT NULL,"
      " checkpoint BLOB NOT NULL);"
      // Newer ones than those of `sessions`, whose rows include long scenes.
      "CREATE TABLE IF NOT EXISTS statuses(uid INTEGER PRIMARY KEY, status BLOB NOT NULL);"
      // Whose edits are still to be removed.
      "CREATE TABLE IF NOT EXISTS removed_sessions(uid INTEGER PRIMARY KEY);"
      "CREATE TABLE IF NOT EXISTS runs(instance TEXT PRIMARY KEY, at INTEGER NOT NULL);"
      // Written by servers that seal their rows: rows of others, earlier or in between, have no
      // seals. A session's seal is of its name, kind and scene; `run` was the newest when it came.
      "CREATE TABLE IF NOT EXISTS sealing_runs(instance TEXT PRIMARY KEY);"
      "CREATE TABLE IF NOT EXISTS seals(uid INTEGER PRIMARY KEY, seal BLOB NOT NULL,"
      " run INTEGER NOT NULL);"
      "CREATE TABLE IF NOT EXISTS replies(client TEXT NOT NULL, id INTEGER NOT NULL,"
      " hash INTEGER NOT NULL, at INTEGER NOT NULL, reply BLOB NOT NULL,"
      " PRIMARY KEY(client, id)) WITHOUT ROWID;"
      "COMMIT");
  auto form = database_.prepare("SELECT version FROM form");
  if (!form.step()) {
    database_.run(fmt::format("INSERT INTO form VALUES({})", kFirstForm).c_str());
  } else if (form.number(0) < kFirstForm || form.number(0) > kForm) {
    throw Error(ErrorCode::kFailedPrecondition, "--data",
                fmt::format("{} is of form {}; this server reads forms {} to {}",
                            database_.file().string(), form.number(0), kFirstForm, kForm));
  }
  files_.remember_log();
  prepare();
  run_ = newest_run();
}

/// A foreign database gets no tables, nor a store that has lost some.
void Writer::check_is_limber_store() {
  auto found = database_.prepare(
      "SELECT count(*), count(*) FILTER (WHERE type = 'table' AND"
      " name IN ('form', 'sessions', 'edits', 'answers')) FROM sqlite_master");
  if (!found.step() || found.number(0) == 0 || found.number(1) == 4) return;
  throw Error(
      ErrorCode::kFailedPrecondition, "--data",
      fmt::format("{} is a database, but not a limberd store: move it away, or name another "
                  "folder",
                  database_.file().string()));
}

void Writer::prepare() {
  const auto sql = [this](const char* text) { return database_.prepare(text); };
  statements_.emplace(Statements{
      sql("DELETE FROM replies WHERE client = ? AND id = ?"),
      // Plain ones: a row that is there was written by somebody else.
      sql("INSERT INTO sessions VALUES(?, ?, ?, ?, ?, 0, ?)"),
      // None of a session that was closed meanwhile.
      sql("INSERT INTO edits SELECT ?, ?, ? WHERE EXISTS (SELECT 1 FROM sessions WHERE uid = ?)"),
      sql("UPDATE sessions SET revision = ?1, touched = ?2 WHERE uid = ?3 AND revision < ?1"),
      sql("INSERT OR REPLACE INTO answers SELECT ?, ? WHERE EXISTS"
          " (SELECT 1 FROM sessions WHERE uid = ?)"),
      // A slow one may come after a newer one, whose edits are removed already.
      sql("INSERT INTO checkpoints SELECT ?, ?, ? WHERE EXISTS"
          " (SELECT 1 FROM sessions WHERE uid = ?) ON CONFLICT(uid) DO UPDATE SET"
          " revision = excluded.revision, checkpoint = excluded.checkpoint"
          " WHERE excluded.revision > checkpoints.revision"),
      sql("UPDATE sessions SET revision = max(revision, ?) WHERE uid = ?"),
      sql("INSERT OR REPLACE INTO replies VALUES(?, ?, ?, ?, ?)"),
      sql("SELECT uid FROM sessions WHERE name = ?"), sql("DELETE FROM sessions WHERE uid = ?"),
      sql("DELETE FROM edits WHERE uid = ?"), sql("DELETE FROM answers WHERE uid = ?"),
      sql("DELETE FROM statuses WHERE uid = ?"), sql("DELETE FROM checkpoints WHERE uid = ?"),
      sql("SELECT revision FROM edits WHERE uid = ? ORDER BY revision LIMIT 1"),
      sql("DELETE FROM edits WHERE uid = ? AND revision <= ?"),
      sql("INSERT OR REPLACE INTO statuses SELECT ?, ? WHERE EXISTS"
          " (SELECT 1 FROM sessions WHERE uid = ?)"),
      sql("INSERT OR REPLACE INTO seals SELECT ?, ?, coalesce(max(rowid), 0) FROM runs"),
      sql("DELETE FROM seals WHERE uid = ?"),
      sql("INSERT OR REPLACE INTO removed_sessions VALUES(?)"),
      sql("DELETE FROM removed_sessions WHERE uid = ?"),
      sql("SELECT coalesce(max(rowid), 0) FROM runs")});
  if (damage_.empty()) find_superseded();
}

/// Cleans up after a server that ended right after a checkpoint, or while it removed a session. The
/// message of a checkpoint names the edits that it replaces; its seal shows whether it is damaged.
void Writer::find_superseded() {
  auto checkpoints = database_.prepare(
      "SELECT uid, revision, checkpoint FROM checkpoints WHERE EXISTS (SELECT 1 FROM edits"
      " WHERE edits.uid = checkpoints.uid AND edits.revision <= checkpoints.revision)");
  while (checkpoints.step()) {
    std::string row = checkpoints.bytes(2);
    proto::StoredCheckpoint checkpoint;
    const std::string place = place_of("checkpoints", checkpoints.number(0), checkpoints.number(1));
    if (take_seal(row, place) != Seal::kWrong && checkpoint.ParseFromString(row) &&
        checkpoint.revision() == checkpoints.number(1))
      superseded_[checkpoints.number(0)] = checkpoint.revision();
  }
  // One that is listed was not removed.
  auto removed = database_.prepare(
      "SELECT uid FROM removed_sessions WHERE uid NOT IN (SELECT uid FROM sessions)");
  while (removed.step()) superseded_[removed.number(0)] = kLastRevision;
  auto unlisted = database_.prepare(
      "SELECT count(*) FROM (SELECT uid FROM edits UNION SELECT uid FROM answers UNION"
      " SELECT uid FROM checkpoints) WHERE uid NOT IN (SELECT uid FROM sessions) AND"
      " uid NOT IN (SELECT uid FROM removed_sessions)");
  if (unlisted.step() && unlisted.number(0) > 0)
    log::error(
        "the store {} has edits or answers of {} sessions that it does not list: it may be damaged,"
        " and they are kept",
        database_.file().string(), unlisted.number(0));
}

/// A damaged number can put one page into two tables. It would be lost with the row of a removed
/// one, so nothing is written to a file with such damage.
void Writer::check_structure() {
  auto found = database_.prepare("PRAGMA quick_check(1)");
  if (!found.step() || found.bytes(0) == "ok") return;
  damage_ = fmt::format(
      "the store {} is damaged, and nothing is changed in it ({}): what can be read can be "
      "exported; bring the file back from a copy, without the files {}-wal and -shm",
      database_.file().string(), found.bytes(0), database_.file().filename().string());
  std::replace(damage_.begin(), damage_.end(), '\n', ' ');
  database_.leave_log();
  log::error("{}", damage_);
}

/// If a frame of the log is damaged, SQLite drops it and all later ones.
void Writer::check_log() {
  auto size = database_.prepare("PRAGMA page_size");
  if (!size.step()) return;
  const std::uint64_t lost = lost_transactions(options_.log(), size.number(0));
  if (lost > 0)
    log::error(
        "the log {} is damaged: its last {} transactions cannot be read, and what they had "
        "acknowledged is lost",
        options_.log().string(), lost);
}

void Writer::remove(std::uint64_t uid) {
  remove_but_edits(uid);
  statements_->forget_edits.again().bind(uid).step();
  begun_.erase(uid);
}

void Writer::remove_but_edits(std::uint64_t uid) {
  statements_->forget_session.again().bind(uid).step();
  statements_->forget_answer.again().bind(uid).step();
  statements_->forget_status.again().bind(uid).step();
  statements_->forget_checkpoint.again().bind(uid).step();
  statements_->forget_seal.again().bind(uid).step();
}

void Writer::take(const OpenedSession& opened) {
  // A session of its name exists if its build failed and it was not closed.
  std::uint64_t other = 0;
  if (auto& find = statements_->find.again().bind_text(opened.name); find.step())
    other = find.number(0);
  statements_->find.again();
  if (other != 0) remove(other);
  statements_->open.again()
      .bind(opened.uid)
      .bind_text(opened.name)
      .bind_text(opened.kind)
      .bind_bytes(opened.scene)
      .bind_bytes(opened.status)
      .bind(now_s())
      .step();
  statements_->seal.again().bind(opened.uid).bind_bytes(opened.seal).step();
}

void Writer::take(const EditedSession& edited) {
  statements_->edit.again()
      .bind(edited.uid)
      .bind(edited.revision)
      .bind_bytes(edited.edit)
      .bind(edited.uid)
      .step();
  if (database_.changed_rows() == 0) return;
  statements_->touch.again().bind(edited.revision).bind(now_s()).bind(edited.uid).step();
  if (database_.changed_rows() == 0)
    throw ConflictingRow(
        fmt::format("edit {} of session {} comes behind a newer one", edited.revision, edited.uid));
}

void Writer::take(const SavedCheckpoint& saved) {
  database_.run(
      fmt::format("UPDATE form SET version = {} WHERE version < {}", kForm, kForm).c_str());
  statements_->checkpoint.again()
      .bind(saved.uid)
      .bind(saved.revision)
      .bind_bytes(saved.checkpoint)
      .bind(saved.uid)
      .step();
  statements_->advance.again().bind(saved.revision).bind(saved.uid).step();
  begun_[saved.uid] = saved.revision;
}

void Writer::forget_superseded(std::uint64_t left) {
  if (superseded_.empty()) return;
  begin();
  try {
    while (left > 0 && !superseded_.empty()) {
      const auto [uid, revision] = *superseded_.begin();
      auto& oldest = statements_->oldest_edit.again().bind(uid);
      const bool is_any = oldest.step() && oldest.number(0) <= revision;
      const std::uint64_t first = is_any ? oldest.number(0) : 0;
      statements_->oldest_edit.again();
      if (!is_any) {
        superseded_.erase(uid);
        statements_->forget_removed.again().bind(uid).step();
        continue;
      }
      const std::uint64_t last = std::min(revision, first + left - 1);
      statements_->forget_until.again().bind(uid).bind(last).step();
      left -= last - first + 1;
    }
    commit();
  } catch (...) {
    roll_back();
    throw;
  }
}

void Writer::make_room(const std::set<std::uint64_t>& uids, const std::vector<KeptReply>& replies) {
  const Sparing sparing(database_);
  begin();
  try {
    for (const std::uint64_t uid : uids) {
      remove_but_edits(uid);
      statements_->removed.again().bind(uid).step();
    }
    for (const KeptReply& reply : replies) take(reply);
    commit();
  } catch (...) {
    roll_back();
    throw;
  }
  for (const std::uint64_t uid : uids) superseded_[uid] = kLastRevision;
  give_back();
}

void Writer::give_back() noexcept {
  if (!damage_.empty() || !end_.empty()) return;
  const auto try_to = [](auto step) {
    try {
      step();
    } catch (const std::exception& fault) {  // another step may go, and some other time this one
      log::debug("room is left in the store: {}", fault.what());
    }
  };
  // A log must not be folded into a file that has lost its name: it is all that is left.
  if (!files_.has_file()) return;
  const Sparing sparing(database_);
  const auto fold = [&] {
    // Free pages are cut off before: the log need not bring them in.
    try_to([&] { database_.run("PRAGMA incremental_vacuum"); });
    try_to([&] { database_.fold_log(); });
  };
  fold();
  try_to([&] {
    while (has_superseded()) {
      forget_superseded(kFewEdits);
      fold();
    }
  });
}

void Writer::take(const ClosedSession& closed) { remove(closed.uid); }

void Writer::take(const KeptReply& reply) {
  statements_->reply.again()
      .bind_text(reply.client)
      .bind(reply.id)
      .bind(reply.hash)
      .bind(now_s())
      .bind_bytes(reply.reply)
      .step();
  forget_replies_beyond(reply);
}

void Writer::forget_replies_beyond(const KeptReply& newest) {
  ClientReplies& replies = replies_[newest.client];
  // It is written again where its transaction failed.
  const auto is_newest = [&](const auto& one) { return one.first == newest.id; };
  if (std::any_of(replies.ids_and_bytes.begin(), replies.ids_and_bytes.end(), is_newest)) return;
  replies.touched_s = now_s();
  replies.ids_and_bytes.emplace_back(newest.id, newest.reply.size());
  replies.bytes += newest.reply.size();
  const auto are_too_many = [&] {
    const std::size_t count = replies.ids_and_bytes.size();
    return count > kRepliesOfClient || (replies.bytes > kReplyBytesOfClient && count > 1);
  };
  while (are_too_many()) {
    const auto [id, bytes] = replies.ids_and_bytes.front();
    replies.ids_and_bytes.pop_front();
    replies.bytes -= bytes;
    if (id != newest.id) statements_->forget_reply.again().bind_text(newest.client).bind(id).step();
  }
}

void Writer::take(const StartedRun& run) {
  auto note = database_.prepare("INSERT OR REPLACE INTO runs VALUES(?, ?)");
  note.bind_text(run.instance).bind(now_s()).step();
  auto seals = database_.prepare("INSERT OR REPLACE INTO sealing_runs VALUES(?)");
  seals.bind_text(run.instance).step();
  begun_run_ = newest_run();
  // Enough for a client to find its own after years of absence. They are removed by their numbers:
  // the newest stays, whatever clocks say.
  database_.run(
      "DELETE FROM runs WHERE rowid <= (SELECT max(rowid) FROM runs) - 10000;"
      "DELETE FROM sealing_runs WHERE instance NOT IN (SELECT instance FROM runs)");
}

void Writer::write_answer(std::uint64_t uid, const KeptAnswer& kept) {
  statements_->answer.again().bind(uid).bind_bytes(kept.answer).bind(uid).step();
  if (kept.status.empty()) return;
  statements_->status.again().bind(uid).bind_bytes(kept.status).bind(uid).step();
}

void Writer::forget_now_and_then() {
  const auto now = std::chrono::steady_clock::now();
  if (now < forget_at_) return;
  forget_at_ = now + std::chrono::minutes(1);
  begin();
  try {
    forget_replies();
    database_.run("PRAGMA incremental_vacuum");
    commit();
  } catch (...) {
    roll_back();
    throw;
  }
}

void Writer::forget_replies() {
  auto replies = database_.prepare("DELETE FROM replies WHERE at < ?");
  const std::uint64_t oldest = now_s() - kReplySeconds;
  replies.bind(oldest).step();
  std::erase_if(replies_, [&](const auto& one) { return one.second.touched_s < oldest; });
}

void Writer::forget_old() {
  begin();
  try {
    forget_replies();
    // Left from sessions that an earlier server removed.
    database_.run(
        "DELETE FROM statuses WHERE uid NOT IN (SELECT uid FROM sessions);"
        "DELETE FROM seals WHERE uid NOT IN (SELECT uid FROM sessions)");
    commit();
  } catch (...) {
    roll_back();
    throw;
  }
}

void Writer::forget_unchanged() {
  const auto retain = static_cast<std::uint64_t>(options_.retain.count());
  if (retain == 0) return;
  std::map<std::uint64_t, std::string> names;
  std::set<std::uint64_t> uids;
  auto old = database_.prepare("SELECT uid, name FROM sessions WHERE touched < ?");
  for (old.bind(now_s() - retain); old.step();) {
    uids.insert(old.number(0));
    names[old.number(0)] = old.bytes(1);
  }
  if (uids.empty()) return;
  make_room(uids, {});
  for (const auto& [uid, name] : names)
    log::info(log::Fields{{"session", name}}, "session {} is removed: nobody has changed it", name);
  log::info("{} sessions are removed that nobody has changed for {} days", names.size(),
            static_cast<double>(retain) / 86400);
}

}  // namespace limber::server::store
