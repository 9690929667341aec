#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "server/store/store_vfs.h"

struct sqlite3;
struct sqlite3_stmt;

namespace limber::server::store {

class Statement;

/// Pages of the file are damaged, or it is none of SQLite's. Code kIo.
class DamagedFile : public Error {
 public:
  explicit DamagedFile(const std::string& message) : Error(ErrorCode::kIo, "", message) {}
};

/// Another process has held the file locked for as long as a statement waits. Code kIo.
class LockedFile : public Error {
 public:
  explicit LockedFile(const std::string& message) : Error(ErrorCode::kIo, "", message) {}
};

/// A row of that key is there. Code kIo.
class ConflictingRow : public Error {
 public:
  explicit ConflictingRow(const std::string& message) : Error(ErrorCode::kIo, "", message) {}
};

/// One connection to a file of SQLite. Used by one thread at a time.
class Database {
 public:
  enum class Access { kRead, kWrite };

  /// While it lives, statements do not wait for locks of other processes.
  class NoWait {
   public:
    explicit NoWait(Database& database);
    ~NoWait();
    NoWait(const NoWait&) = delete;
    NoWait& operator=(const NoWait&) = delete;

   private:
    Database& database_;
  };

  /// Makes the file where there is none, for kWrite.
  /// @throws Error{kIo} naming the file
  Database(const std::filesystem::path& file, Access access);

  /// Statements without values. @throws Error{kIo}
  void run(const char* sql);
  [[nodiscard]] Statement prepare(const char* sql);
  /// Brings the write-ahead log into the file and gives its space back, as far as readers let it.
  /// Does nothing where the disk has no room for the file to grow by that: half of it would take
  /// the last room for nothing. @throws Error{kIo}
  void fold_log();
  /// Copies the committed state into another file, which is made anew or overwritten. Others may
  /// read and write meanwhile. @throws Error{kIo}
  void copy_to(const std::filesystem::path& copy);
  /// Rows that the last statement has changed.
  [[nodiscard]] std::uint64_t changed_rows() const;
  [[nodiscard]] std::optional<LogIndex> log_index() const;
  /// The log is not brought into the file when this is closed.
  void leave_log() noexcept;
  /// Undoes an open transaction; does nothing without one.
  void roll_back() noexcept;
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A prepared statement. Values are bound in order, from the first; rows are read as they come.
/// Must not outlive its database.
class Statement {
 public:
  Statement(sqlite3* handle, sqlite3_stmt* statement, std::string file)
      : handle_(handle), statement_(statement), file_(std::move(file)) {}

  /// From the beginning, without values.
  Statement& again();
  Statement& bind(std::uint64_t value);
  /// @pre the bytes live until the statement has run
  Statement& bind_text(std::string_view text);
  Statement& bind_bytes(std::string_view bytes);
  /// @returns whether there is a row, or another one. @throws Error{kIo}
  bool step();

  [[nodiscard]] std::uint64_t number(int column) const;
  [[nodiscard]] std::string bytes(int column) const;

 private:
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };

  void demand(int code) const;

  sqlite3* handle_;
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
  std::string file_;
  int bound_ = 0;
};

}  // namespace limber::server::store
