#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/store/changes.h"
#include "server/store/options.h"
#include "server/store/sqlite.h"

namespace limber::server::store {

/// The writing end of a store's file: its tables, and what changes do to them. One thread.
class Writer {
 public:
  /// Makes the tables where there are none.
  /// @throws Error{kIo}; {kFailedPrecondition, "folder"} for a file of a newer form
  explicit Writer(const StoreOptions& options);

  void begin();
  void commit();
  void roll_back() noexcept { database_.roll_back(); }
  void write(const Change& change);
  void write_answer(std::uint64_t uid, const std::string& answer);
  /// Sessions that were not changed for so long, and old replies.
  void forget_old();
  /// Old replies, once a minute; free pages go back to the disk.
  void forget_now_and_then();

 private:
  void prepare();
  void take(const OpenedSession& opened);
  void take(const EditedSession& edited);
  void take(const ClosedSession& closed);
  void take(const KeptReply& reply);
  void take(const StartedRun& run);
  void remove(std::uint64_t uid);
  void forget_replies();

  const StoreOptions options_;
  std::chrono::steady_clock::time_point forget_at_{};
  Database database_;
  struct Statements {
    Statement open, edit, touch, answer, reply, find, forget_session, forget_edits, forget_answer;
  };
  std::optional<Statements> statements_;
};

}  // namespace limber::server::store
