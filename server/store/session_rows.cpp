#include "server/store/session_rows.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <string>

#include "engine/base/error.h"
#include "server/log/log.h"
#include "server/store/row_seal.h"
#include "server/store/store.h"

namespace limber::server::store {
namespace {

namespace proto = limber::v1;

/// Earlier servers wrote the bytes of a connection in place of a client's name, with which no edit
/// can be read. @returns the edit without it; as it is, where it is damaged otherwise
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
    auto row = rows("SELECT name, kind, scene, status, revision FROM sessions WHERE uid = ?");
    if (!row.step())
      throw Error(ErrorCode::kNotFound, "session", "the session is not in the store any more");
    stored_.set_session(row.bytes(0));
    stored_.set_kind(row.bytes(1));
    const std::string scene = row.bytes(2);
    const auto status = unsealed(row.bytes(3), {stored_.session(), stored_.kind(), scene});
    if (status.is_damaged || !stored_.mutable_scene()->ParseFromString(scene))
      refuse("its scene is damaged");
    return row.number(4);
  }

  /// @returns its revision; 0: there is none
  std::uint64_t read_checkpoint() {
    auto row = rows("SELECT revision, checkpoint FROM checkpoints WHERE uid = ?");
    if (!row.step()) return 0;
    const auto checkpoint = unsealed(row.bytes(1));
    if (checkpoint.is_damaged || !stored_.mutable_checkpoint()->ParseFromString(checkpoint.message))
      refuse("its checkpoint is damaged");
    stored_.set_version(Store::kWithCheckpoint);
    return row.number(0);
  }

  /// @returns the last revision
  std::uint64_t read_edits(std::uint64_t after) {
    auto row =
        rows("SELECT revision, edit FROM edits WHERE uid = ? AND revision > ? ORDER BY revision");
    row.bind(after);
    while (row.step()) {
      if (row.number(0) != ++after) refuse_gap(after);
      const auto [bytes, is_damaged] = unsealed(row.bytes(1));
      auto& edit = *stored_.add_edits();
      if (is_damaged ||
          !(edit.ParseFromString(bytes) || edit.ParseFromString(without_client(bytes))))
        refuse(fmt::format("its edit {} is damaged", after));
    }
    return after;
  }

  void read_answer() {
    bool is_damaged = false;
    try {
      auto row = rows("SELECT answer FROM answers WHERE uid = ?");
      if (!row.step()) return;
      const auto answer = unsealed(row.bytes(0));
      is_damaged = answer.is_damaged || !stored_.mutable_answer()->ParseFromString(answer.message);
    } catch (const DamagedFile&) {
      is_damaged = true;
    }
    if (!is_damaged) return;
    log::warn(log::Fields{{"session", stored_.session()}},
              "the stored answer of session {} is damaged, and left out", stored_.session());
    stored_.clear_answer();
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
                fmt::format("{} in the store {}", what, database_.file().string()));
  }

  Database& database_;
  const std::uint64_t uid_;
  proto::StoredSession stored_;
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
