#include "server/store/sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <system_error>

namespace limber::server::store {
namespace {

// For locks of other processes. With the store's pause between two attempts to write it is less
// than the 2 s after which an edit is answered [ms].
constexpr int kBusyTime = 1400;

[[noreturn]] void fail(const std::string& file, sqlite3* handle, int code) {
  const char* const text = handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(code);
  const std::string message = fmt::format("the store {}: {}", file, text);
  const int kind = code & 0xff;  // of an extended code
  if (kind == SQLITE_CORRUPT || kind == SQLITE_NOTADB)
    throw DamagedFile(message + "; bring the file back from a copy, without those of its log");
  if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED)
    throw LockedFile(message + "; another process holds it");
  if (kind == SQLITE_CONSTRAINT) throw ConflictingRow(message);
  throw Error(ErrorCode::kIo, "", message);
}

}  // namespace

void Database::Close::operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }

Database::Database(const std::filesystem::path& file, Access access) : file_(file) {
  const int flags =
      access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  // A mutex of SQLite's own is not needed: one thread at a time.
  const int code = sqlite3_open_v2(file.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, store_vfs());
  handle_.reset(handle);
  if (code != SQLITE_OK) fail(file.string(), handle, code);
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyTime);
}

Database::NoWait::NoWait(Database& database) : database_(database) {
  sqlite3_busy_timeout(database_.handle_.get(), 0);
}

Database::NoWait::~NoWait() { sqlite3_busy_timeout(database_.handle_.get(), kBusyTime); }

void Database::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(file_.string(), handle_.get(), code);
}

Statement Database::prepare(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(handle_.get(), sql, -1, &statement, nullptr);
  if (code != SQLITE_OK) fail(file_.string(), handle_.get(), code);
  return {handle_.get(), statement, file_.string()};
}

void Database::fold_log() {
  const auto number_of = [this](const char* sql) {
    auto rows = prepare(sql);
    return rows.step() ? rows.number(0) : 0;
  };
  const std::uint64_t bytes = number_of("PRAGMA page_count") * number_of("PRAGMA page_size");
  std::error_code fault;
  const std::uint64_t present = std::filesystem::file_size(file_, fault);
  const std::uint64_t available = std::filesystem::space(file_, fault).available;
  if (!fault && bytes > present && bytes - present > available) return;
  run("PRAGMA wal_checkpoint(TRUNCATE)");
}

void Database::copy_to(const std::filesystem::path& copy) {
  Database target(copy, Access::kWrite);
  sqlite3_backup* const backup =
      sqlite3_backup_init(target.handle_.get(), "main", handle_.get(), "main");
  if (backup == nullptr)
    fail(copy.string(), target.handle_.get(), sqlite3_errcode(target.handle_.get()));
  constexpr int kAllPages = -1;  // in one breath: a writer meanwhile does not begin it anew
  (void)sqlite3_backup_step(backup, kAllPages);
  const int code = sqlite3_backup_finish(backup);
  if (code != SQLITE_OK) fail(copy.string(), target.handle_.get(), code);
}

std::uint64_t Database::changed_rows() const {
  return static_cast<std::uint64_t>(sqlite3_changes(handle_.get()));
}

std::optional<LogIndex> Database::log_index() const { return store::log_index(handle_.get()); }

void Database::leave_log() noexcept {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

void Database::roll_back() noexcept {
  if (sqlite3_get_autocommit(handle_.get()) == 0)
    sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Statement::Finalise::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

void Statement::demand(int code) const {
  if (code != SQLITE_OK) fail(file_, handle_, code);
}

Statement& Statement::again() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
  bound_ = 0;
  return *this;
}

Statement& Statement::bind(std::uint64_t value) {
  // Bit for bit: SQLite's integers have a sign.
  demand(sqlite3_bind_int64(statement_.get(), ++bound_, static_cast<sqlite3_int64>(value)));
  return *this;
}

Statement& Statement::bind_text(std::string_view text) {
  demand(sqlite3_bind_text64(statement_.get(), ++bound_, text.data(), text.size(), SQLITE_STATIC,
                             SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind_bytes(std::string_view bytes) {
  // A null pointer would be NULL, no empty value.
  demand(bytes.empty() ? sqlite3_bind_zeroblob(statement_.get(), ++bound_, 0)
                       : sqlite3_bind_blob64(statement_.get(), ++bound_, bytes.data(), bytes.size(),
                                             SQLITE_STATIC));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  fail(file_, handle_, code);
}

std::uint64_t Statement::number(int column) const {
  return static_cast<std::uint64_t>(sqlite3_column_int64(statement_.get(), column));
}

std::string Statement::bytes(int column) const {
  const void* const data = sqlite3_column_blob(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return size == 0 ? std::string() : std::string(static_cast<const char*>(data), size);
}

}  // namespace limber::server::store
