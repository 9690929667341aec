#include "server/store/session_rows.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <optional>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "server/log/log.h"
#include "server/store/row_seal.h"
#include "server/store/store.h"

namespace limber::server::store {
namespace {

namespace proto = limber::v1;

/// Earlier servers wrote the bytes of a connection in place of a client's name; such an edit cannot
/// be read. @returns the edit without it; unchanged if damaged otherwise
std::string without_client(const std::string& edit) {
  using google::protobuf::internal::WireFormatLite;
  google::protobuf::io::CodedInputStream bytes(reinterpret_cast<const std::uint8_t*>(edit.data()),
                                               static_cast<int>(edit.size()));
  std::string left;
  for (;;) {
    const int begin = bytes.CurrentPosition();
    const std::uint32_t tag = bytes.ReadTag();
    if (tag == 0) return bytes.ConsumedEntireMessage() ? left : edit;
    if (!WireFormatLite::SkipField(&bytes, tag)) return edit;
    if (WireFormatLite::GetTagFieldNumber(tag) == proto::StoredEdit::kClientFieldNumber) continue;
    left.append(edit, static_cast<std::size_t>(begin),
                static_cast<std::size_t>(bytes.CurrentPosition() - begin));
  }
}

class SessionRows {
 public:
  SessionRows(Database& database, std::uint64_t uid) : database_(database), uid_(uid) {}

  proto::StoredSession read() {
    stored_.set_version(Store::kWithoutCheckpoint);
    stored_.set_uid(uid_);
    const std::uint64_t newest = read_head();
    const std::uint64_t last = read_edits(read_checkpoint());
    if (last < newest) refuse_gap(last + 1);
    read_answer();
    clear_seals(stored_);
    return std::move(stored_);
  }

 private:
  /// @returns the newest revision
  std::uint64_t read_head() {
    auto row = rows("SELECT name, kind, scene, revision FROM sessions WHERE uid = ?");
    if (!row.step())
      throw Error(ErrorCode::kNotFound, "session", "the session is not in the store any more");
    stored_.set_session(row.bytes(0));
    stored_.set_kind(row.bytes(1));
    const std::string scene = row.bytes(2);
    if (!is_sealed_as(scene) || !stored_.mutable_scene()->ParseFromString(scene))
      refuse("its scene is damaged");
    return row.number(3);
  }

  /// If the session has a seal, so have all its rows, unless a server without seals has used the
  /// store since. A row that has lost its end has lost its seal.
  bool is_sealed_as(const std::string& scene) {
    auto row = rows(
        "SELECT seal, NOT EXISTS (SELECT 1 FROM runs WHERE runs.rowid > seals.run AND"
        " instance NOT IN (SELECT instance FROM sealing_runs)) FROM seals WHERE uid = ?");
    if (!row.step()) return true;
    must_be_sealed_ = row.number(1) != 0;
    return row.bytes(0) == seal_of({stored_.session(), stored_.kind(), scene});
  }

  /// @returns its revision; 0: there is none
  std::uint64_t read_checkpoint() {
    auto row = rows("SELECT revision, checkpoint FROM checkpoints WHERE uid = ?");
    if (!row.step()) return 0;
    auto& checkpoint = *stored_.mutable_checkpoint();
    if (!read_into(checkpoint, row.bytes(1), place_of("checkpoints", uid_, row.number(0))) ||
        checkpoint.revision() != row.number(0))
      refuse("its checkpoint is damaged");
    stored_.set_version(Store::kWithCheckpoint);
    return checkpoint.revision();
  }

  /// @returns the last revision
  std::uint64_t read_edits(std::uint64_t after) {
    auto row =
        rows("SELECT revision, edit FROM edits WHERE uid = ? AND revision > ? ORDER BY revision");
    row.bind(after);
    while (row.step()) {
      if (row.number(0) != ++after) refuse_gap(after);
      auto& edit = *stored_.add_edits();
      const auto bytes = unsealed(row.bytes(1), place_of("edits", uid_, after));
      const bool is_read =
          bytes && (edit.ParseFromString(*bytes) || edit.ParseFromString(without_client(*bytes)));
      if (!is_read || edit.revision() != after)
        refuse(fmt::format("its edit {} is damaged", after));
    }
    return after;
  }

  void read_answer() {
    bool is_damaged = false;
    try {
      auto row = rows("SELECT answer FROM answers WHERE uid = ?");
      auto status = rows("SELECT 1 FROM statuses WHERE uid = ?");  // written with an answer
      is_damaged = row.step() ? !read_into(*stored_.mutable_answer(), row.bytes(0),
                                           place_of("answers", uid_))
                              : status.step();
    } catch (const DamagedFile&) {
      is_damaged = true;
    }
    if (!is_damaged) return;
    log::warn(log::Fields{{"session", stored_.session()}},
              "the stored answer of session {} is damaged, and left out", stored_.session());
    stored_.clear_answer();
  }

  /// @returns the message; nothing where it is not as it was written
  std::optional<std::string> unsealed(std::string row, const std::string& place) const {
    const Seal seal = take_seal(row, place);
    if (seal == Seal::kWrong || (seal == Seal::kNone && must_be_sealed_)) return std::nullopt;
    return row;
  }
  bool read_into(google::protobuf::Message& message, std::string row,
                 const std::string& place) const {
    const auto bytes = unsealed(std::move(row), place);
    return bytes && message.ParseFromString(*bytes);
  }
  Statement rows(const char* sql) {
    auto statement = database_.prepare(sql);
    statement.bind(uid_);
    return statement;
  }
  [[noreturn]] void refuse_gap(std::uint64_t revision) const {
    refuse(fmt::format("its edit {} is missing", revision));
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(ErrorCode::kIo, "session",
                fmt::format("session '{}': {} in the store {}; bring the store back from a copy, "
                            "or remove the session and import a file that it was exported to",
                            stored_.session(), what, database_.file().string()));
  }

  Database& database_;
  const std::uint64_t uid_;
  proto::StoredSession stored_;
  bool must_be_sealed_ = false;
};

}  // namespace

void clear_seals(proto::StoredSession& session) {
  for (auto& edit : *session.mutable_edits()) edit.clear_seal();
  if (session.has_checkpoint()) session.mutable_checkpoint()->clear_seal();
  if (session.has_answer()) session.mutable_answer()->clear_seal();
}

proto::StoredSession read_session(Database& database, std::uint64_t uid) {
  return SessionRows(database, uid).read();
}

}  // namespace limber::server::store
