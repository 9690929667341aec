#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/store/changes.h"
#include "server/store/options.h"
#include "server/store/sqlite.h"
#include "server/store/watched_files.h"

namespace limber::server::store {

/// A writer has ended for good: its writes could be lost, or replace those of another server. Code
/// kIo.
class WriterHasEnded : public Error {
 public:
  explicit WriterHasEnded(const std::string& message) : Error(ErrorCode::kIo, "", message) {}
};

/// The writing end of a store's file: its tables, and what changes do to them. One thread.
///
/// If two servers use one folder, the one that began later writes. The row number of its run is the
/// newest one of the table `runs`, and every transaction of another server ends at that.
class Writer {
 public:
  /// Makes the tables where there are none; else nothing is written.
  /// @throws Error{kIo}; {kFailedPrecondition, "--data"} for a file of a newer form
  explicit Writer(const StoreOptions& options);
  /// The log of a file that has lost its name stays.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// @throws Error{kIo}, also where the file is not in its folder any more; WriterHasEnded where
  /// its log is not, or another server has begun to write
  void begin();
  void commit();
  void roll_back() noexcept {
    begun_.clear();
    begun_run_.reset();
    database_.roll_back();
  }
  /// During the lifetime of the returned object, locks of other processes are LockedFile at once.
  [[nodiscard]] Database::NoWait without_waiting() { return Database::NoWait(database_); }
  [[nodiscard]] std::optional<LogIndex> log_index() const { return database_.log_index(); }
  void write(const Change& change);
  void write_answer(std::uint64_t uid, const KeptAnswer& answer);
  /// Whether there are edits that a checkpoint replaces.
  [[nodiscard]] bool has_superseded() const { return !superseded_.empty(); }
  /// Removes so many of them, in a transaction of its own: those that wait for the store are not
  /// held up for longer.
  void forget_superseded(std::uint64_t edits = 4096);
  /// Removes sessions, with replies to the clients that closed them, in as little space as
  /// possible. Their edits go in parts, and the log and free pages of the file are released.
  /// @throws Error{kIo}: nothing is removed
  void make_room(const std::set<std::uint64_t>& uids, const std::vector<KeptReply>& replies);
  /// Superseded edits, the log and free pages of the file go back to the disk, as far as possible.
  void give_back() noexcept;
  /// They are removed behind the next checkpoint, or by the next server.
  void leave_superseded() { superseded_.clear(); }
  /// Old replies, and what closed sessions have left.
  void forget_old();
  /// Removes sessions that were not changed for so long (StoreOptions::retain).
  void forget_unchanged();
  /// Old replies, once a minute; free pages go back to the disk.
  void forget_now_and_then();

 private:
  void prepare();
  void find_superseded();
  void demand_file() const;
  void demand_log();
  void demand_own_run();
  void demand_short_log();
  [[nodiscard]] std::uint64_t newest_run();
  [[nodiscard]] std::string fold_removed_log();
  [[noreturn]] void end(const std::string& why);
  void check_is_limber_store();
  void check_structure();
  void check_log();
  void take(const OpenedSession& opened);
  void take(const EditedSession& edited);
  void take(const SavedCheckpoint& saved);
  void take(const ClosedSession& closed);
  void take(const KeptReply& reply);
  void take(const StartedRun& run);
  void remove(std::uint64_t uid);
  void remove_but_edits(std::uint64_t uid);
  void forget_replies();
  void forget_replies_beyond(const KeptReply& newest);

  const StoreOptions options_;
  std::chrono::steady_clock::time_point forget_at_{};
  /// Revisions up to which sessions have checkpoints, where edits before may be left.
  std::map<std::uint64_t, std::uint64_t> superseded_;
  std::map<std::uint64_t, std::uint64_t> begun_;  // the same, of this transaction
  /// Replies to a client that this writer has written, the oldest first.
  struct ClientReplies {
    std::deque<std::pair<std::uint64_t, std::uint64_t>> ids_and_bytes;
    std::uint64_t bytes = 0, touched_s = 0;
  };
  std::map<std::string, ClientReplies> replies_;
  Database database_;
  WatchedFiles files_;
  std::string damage_;     // of the file, why nothing is written; empty: none
  std::string end_;        // why nothing is written any more; empty: it is
  std::uint64_t run_ = 0;  // the newest one that this writer knows: its own, once it has begun
  std::optional<std::uint64_t> begun_run_;  // the same, of this transaction
  struct Statements {
    Statement forget_reply, open, edit, touch, answer, checkpoint, advance, reply, find,
        forget_session, forget_edits, forget_answer, forget_status, forget_checkpoint, oldest_edit,
        forget_until, status, seal, forget_seal, removed, forget_removed, newest_run;
  };
  std::optional<Statements> statements_;
};

}  // namespace limber::server::store
