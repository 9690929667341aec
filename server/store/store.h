#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "limber/v1/stored.pb.h"
#include "server/store/changes.h"
#include "server/store/folder_lock.h"
#include "server/store/options.h"
#include "server/store/reserve.h"
#include "server/store/sqlite.h"

namespace limber::server::store {

namespace proto = limber::v1;
class Writer;

/// The sessions of a server in one file (SQLite, write-ahead log), so that they outlive it.
/// Thread-safe.
///
/// Changes are written in the order in which they came, by a thread of the store's own; those that
/// wait together are one transaction and one sync. If that fails, all of it is kept and tried again
/// until it succeeds; waiting callers learn the reason at once. A store whose log was removed, or
/// that another server has begun to write to, is not written any more.
class Store {
 public:
  /// Called once, by the store's thread (or by the caller's, if that has ended or cannot write). It
  /// gets null after the changes are written for good, else the reason for the delay.
  using Done = std::function<void(const std::exception_ptr& fault)>;

  /// Opens or makes the file, and begins to write. One server at a time has a folder.
  /// @throws Error{kIo} naming the folder or file; {kFailedPrecondition, "--data"} where another
  /// server has it, or its file is of a newer form or not a store
  explicit Store(StoreOptions options);
  ~Store();  // as end()
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// @param keep  what becomes of changes that cannot be written now
  enum class Keep { kUntilWritten, kNotAtAll };
  void append(std::vector<Change> changes, Done done, Keep keep = Keep::kUntilWritten);
  /// Replaces the one that waits or is stored.
  /// @param done  called once this one or a newer one is written, or cannot be now
  void keep_answer(std::uint64_t uid, KeptAnswer answer, Done done = nullptr);
  /// Stands for the edits of a session up to a revision, which must have been given before: they go
  /// once it is written. If it cannot be written, it is given up, and they stay.
  void keep_checkpoint(SavedCheckpoint checkpoint);
  /// Returns when all that was given is written, or could not be.
  void flush();

  /// Writes what waits, and nothing that comes later. Once, or again without effect.
  /// @returns changes of sessions that could not be written and are lost: the log reports them, too
  std::size_t end();

  /// Why changes cannot be written now; empty: they can.
  [[nodiscard]] std::string fault() const;
  /// A warning for administrators while changes are written; empty: nothing.
  [[nodiscard]] std::string warning() const;
  [[nodiscard]] std::vector<StoredHead> heads();
  /// @throws Error{kNotFound, "session"}; {kIo} where it cannot be read
  [[nodiscard]] proto::StoredSession load(std::uint64_t uid);
  /// StoredSession.version.
  static constexpr std::uint32_t kWithoutCheckpoint = 1, kWithCheckpoint = 2;
  /// Notes that a server of this instance has the folder: whether changes can be written is known
  /// behind it. @returns those that had it before
  [[nodiscard]] std::set<std::string> begin_run(const std::string& instance);
  /// Replies that are younger than so many seconds; empty where they are damaged.
  [[nodiscard]] std::vector<KeptReply> replies(std::uint64_t seconds);

  struct Counts {
    std::uint64_t bytes = 0;  // of the file and its log
    std::uint64_t log_bytes = 0;
    std::uint64_t commits = 0, changes = 0;
    std::uint64_t synced_commits = 0;  // before they were acknowledged
  };
  [[nodiscard]] Counts counts() const;
  [[nodiscard]] std::filesystem::path file() const;

 private:
  struct Batch {
    std::vector<Change> changes;
    Done done;
    Keep keep = Keep::kUntilWritten;
  };
  struct WaitingAnswer {
    KeptAnswer newest;
    std::vector<Done> done;  // of this one and of those that it has replaced
  };
  struct Work {
    std::deque<Batch> batches;
    std::map<std::uint64_t, WaitingAnswer> answers;
    std::map<std::uint64_t, SavedCheckpoint> checkpoints;  // of each session the newest
  };

  void write_all();
  void take_waiting(Work& work);
  [[nodiscard]] static std::size_t count_of(const Work& work);
  [[nodiscard]] static std::vector<Done> take_answer_callbacks(Work& work);
  void write(const Work& work);
  struct Outcome {
    std::string fault;           // why not; empty: all of it is written
    bool may_room_help = false;  // on the disk, to what failed
  };
  [[nodiscard]] Outcome try_to_write(const Work& work);
  /// For changes that could not be written: closed sessions make room first.
  /// @returns whether there were such, and they are removed
  bool make_room(Work& work);
  [[nodiscard]] bool remove(const std::set<std::uint64_t>& uids,
                            const std::vector<KeptReply>& replies);
  void open_writer();
  void keep_house(Work& work);
  void forget_now_and_then();
  /// @returns false where another process holds the file: later, then
  [[nodiscard]] bool write_checkpoints(Work& work);
  [[nodiscard]] bool forget_superseded();
  void note_written(std::size_t changes);
  void note_fault(const std::string& fault);
  void note_log();

  const StoreOptions options_;
  const FolderLock lock_;
  Reserve reserve_;
  std::unique_ptr<Writer> writer_;
  std::mutex reading_;
  std::optional<Database> reader_;

  mutable std::mutex mutex_;
  std::condition_variable changed_, idle_;
  Work waiting_;
  bool is_ending_ = false, is_writing_ = false;
  std::string fault_, warning_;
  std::uint64_t commits_ = 0, changes_ = 0;
  std::size_t lost_ = 0;  // in the end
  std::thread thread_;    // last: it uses the rest
};

}  // namespace limber::server::store
