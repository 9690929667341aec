// Transactions of the writer: checks that it may begin one, and that its files are still there.

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "server/store/writer.h"

namespace limber::server::store {

void Writer::begin() {
  if (!end_.empty()) throw WriterHasEnded(end_);
  demand_file();
  demand_short_log();
  database_.run("BEGIN IMMEDIATE");
  try {
    demand_log();
    demand_own_run();
  } catch (...) {
    roll_back();
    throw;
  }
}

Writer::~Writer() {
  if (!files_.has_file()) database_.leave_log();
}

/// Data written to a file that was removed or moved away are lost.
void Writer::demand_file() const {
  if (!damage_.empty()) throw DamagedFile(damage_);
  if (files_.has_file()) return;
  throw Error(ErrorCode::kIo, "",
              fmt::format("the store {} was removed or moved away: bring it back, or start limberd "
                          "again",
                          database_.file().string()));
}

/// Before a transaction and behind it: SQLite would go on with a log that has no name.
void Writer::demand_log() {
  const auto state = files_.log(database_);
  if (state == WatchedFiles::Log::kSound) return;
  const std::string log = options_.log().string();
  if (state == WatchedFiles::Log::kRemoved)
    end(fmt::format("the log {} was removed: {}; start limberd again", log, fold_removed_log()));
  if (state == WatchedFiles::Log::kReplaced)
    end(
        fmt::format("another file has the place of the log {} or of its index: changes that were "
                    "acknowledged last may be missing in the store; bring it back from a copy",
                    log));
  end(fmt::format(
      "the log {} was cut off: changes that were acknowledged last may be missing in the "
      "store; bring it back from a copy",
      log));
}

/// Folds the part that SQLite still holds into the file. @returns the outcome
std::string Writer::fold_removed_log() {
  roll_back();
  try {
    auto folded = database_.prepare("PRAGMA wal_checkpoint(TRUNCATE)");
    if (folded.step() && folded.number(0) == 0)
      return "all changes that were acknowledged are in the file of the store";
    return "somebody reads the store, and changes that were acknowledged last may be missing in "
           "its "
           "file";
  } catch (const std::exception& fault) {
    return fmt::format("changes that were acknowledged last may be missing in the store ({})",
                       fault.what());
  }
}

void Writer::demand_own_run() {
  if (newest_run() == run_) return;
  end(fmt::format(
      "another limberd has begun to write to the store {}: this one has ended to write, "
      "and changes nothing any more",
      database_.file().string()));
}

/// A file that is bounded has a log that is, too.
void Writer::demand_short_log() {
  const auto is_short = [this] {
    const auto index = database_.log_index();
    return !index || index->unfolded_bytes() <= options_.bytes + kUnfoldedBytes;
  };
  if (options_.bytes == 0 || is_short()) return;
  database_.run("PRAGMA wal_checkpoint(PASSIVE)");
  if (is_short()) return;
  throw LockedFile(fmt::format(
      "the log {} has grown beyond the bound of the store (--data-bytes), since another "
      "process reads the store in a transaction that does not end",
      options_.log().string()));
}

std::uint64_t Writer::newest_run() {
  auto& newest = statements_->newest_run.again();
  const std::uint64_t run = newest.step() ? newest.number(0) : 0;
  newest.again();
  return run;
}

void Writer::end(const std::string& why) {
  roll_back();
  database_.leave_log();
  end_ = why;
  throw WriterHasEnded(end_);
}

void Writer::commit() {
  database_.run("COMMIT");
  demand_log();
  for (const auto& [uid, revision] : begun_)
    superseded_[uid] = std::max(superseded_[uid], revision);
  begun_.clear();
  if (begun_run_) run_ = *std::exchange(begun_run_, std::nullopt);
}

void Writer::write(const Change& change) try {
  std::visit([this](const auto& one) { take(one); }, change);
} catch (const ConflictingRow& conflict) {
  end(
      fmt::format("somebody else has written to the store what this limberd was about to write: it "
                  "has ended to write, and changes nothing any more ({})",
                  conflict.what()));
}

}  // namespace limber::server::store
