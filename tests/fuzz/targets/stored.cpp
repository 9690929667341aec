// Rows of the server's store with damaged values, and sessions that were exported: up to the scene
// and the edits that a session would be brought back from.
//
// An input that begins with 'x' is an exported session. Of others, lines of a row each: a table's
// letter (s: a session, e: an edit, a: an answer, c: a checkpoint, r: a reply), numbers, and behind
// ':' the value; a row ends with "\n%%%\n". Rows with a capital letter are sealed.
#include <unistd.h>

#include <cctype>
#include <charconv>
#include <filesystem>
#include <memory>
#include <string>

#include "limber/v1/stored.pb.h"
#include "server/kinds/beams/checkpoint.h"
#include "server/kinds/bodies/checkpoint.h"
#include "server/kinds/linkages/checkpoint.h"
#include "server/log/log.h"
#include "server/service/imported_session.h"
#include "server/store/row_seal.h"
#include "server/store/store.h"
#include "server/wire/errors.h"
#include "server/wire/wire_check.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;
namespace fs = std::filesystem;
namespace proto = limber::v1;
namespace store = limber::server::store;

/// As KeptSessions::restore() reads it.
void restore(const proto::StoredSession& stored) {
  fuzz::decode_scene(stored.scene());
  fuzz::decode_scene(stored.answer().start());
  const proto::StoredCheckpoint& checkpoint = stored.checkpoint();
  fuzz::answers([&] { (void)server::decode_body_checkpoint(checkpoint.body(), 1); });
  fuzz::answers([&] { (void)server::decode_linkage_checkpoint(checkpoint.linkage(), 1); });
  fuzz::answers([&] { (void)server::decode_beam_checkpoint(checkpoint.beams(), 1); });
  for (const auto& edit : stored.edits()) {
    proto::EditRequest request;
    request.set_session(stored.session());
    *request.mutable_edits() = edit.edits();
    fuzz::decode_edits(request);
  }
}

void restore_export(std::string_view bytes) {
  proto::StoredSession stored;
  if (!fuzz::answers([&] {
        server::check_wire(bytes, *proto::StoredSession::descriptor());
        if (!stored.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
          throw server::malformed("no session");
        server::demand_countable(stored);
      }))
    return;
  restore(stored);
}

/// A store in memory's file system, emptied for every input.
class Rows {
 public:
  Rows()
      : folder_(fs::path(fs::is_directory("/dev/shm") ? "/dev/shm" : fs::temp_directory_path()) /
                ("limber-fuzz-" + std::to_string(::getpid()))) {
    server::log::set_level(server::log::Level::kOff);
    fs::create_directories(folder_);
    store::StoreOptions options;
    options.folder = folder_;
    options.durability = store::Durability::kProcess;
    store_ = std::make_unique<store::Store>(options);
    writer_ = std::make_unique<store::Database>(options.file(), store::Database::Access::kWrite);
  }
  ~Rows() {
    writer_.reset();
    store_.reset();
    fs::remove_all(folder_);
  }
  void clear() {
    for (const char* table : {"sessions", "edits", "answers", "checkpoints", "replies", "seals"})
      writer_->run((std::string("DELETE FROM ") + table).c_str());
  }
  void add(std::string_view given);
  void begin() { writer_->run("BEGIN IMMEDIATE"); }
  void commit() { writer_->run("COMMIT"); }
  [[nodiscard]] store::Store& store() { return *store_; }

 private:
  void insert(const char* sql, std::uint64_t first, std::uint64_t second, std::string_view value) {
    auto statement = writer_->prepare(sql);
    statement.again().bind(first).bind(second).bind_bytes(value).step();
  }

  const fs::path folder_;
  std::unique_ptr<store::Store> store_;
  std::unique_ptr<store::Database> writer_;
};

std::uint64_t take_number(std::string_view& text) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
  if (!text.empty()) text.remove_prefix(1);
  return number;
}

std::string place_of(char table, std::uint64_t first, std::uint64_t second) {
  if (table == 'r') return store::place_of_reply("client", first);
  if (table == 'a') return store::place_of("answers", first);
  return store::place_of(table == 'e' ? "edits" : "checkpoints", first, second);
}

void Rows::add(std::string_view given) {
  if (given.empty()) return;
  const auto letter = static_cast<unsigned char>(given.front());
  const auto table = static_cast<char>(std::tolower(letter));
  const bool is_sealed = std::isupper(letter) != 0;
  given.remove_prefix(1);
  const std::uint64_t first = take_number(given), second = take_number(given);
  std::string row(given);
  if (is_sealed && table != 's') store::add_seal(row, place_of(table, first, second));
  switch (table) {
    case 's':
      if (is_sealed) {
        insert("INSERT OR REPLACE INTO seals VALUES(?1, ?3, ?2)", first, 0,
               store::seal_of({"s" + std::to_string(first), "bodies", row}));
      }
      return insert(
          "INSERT OR REPLACE INTO sessions SELECT ?1, CAST('s' || ?1 AS TEXT), 'bodies', ?3, ?3, "
          "?2, 9000000000",
          first, second, row);
    case 'e':
      return insert("INSERT OR REPLACE INTO edits VALUES(?1, ?2, ?3)", first, second, row);
    case 'c':
      return insert("INSERT OR REPLACE INTO checkpoints VALUES(?1, ?2, ?3)", first, second, row);
    case 'a':
      return insert("INSERT OR REPLACE INTO answers SELECT ?1, ?3 WHERE ?2 >= 0", first, second,
                    row);
    case 'r':
      return insert("INSERT OR REPLACE INTO replies VALUES('client', ?1, ?2, 9000000000, ?3)",
                    first, second, row);
    default:
      return;
  }
}

void restore_rows(std::string_view text) {
  static Rows rows;
  rows.begin();
  rows.clear();
  for (int i = 0; i < 16 && !text.empty(); ++i) rows.add(fuzz::take_until(text, "\n%%%\n"));
  rows.commit();
  // As KeptSessions::recall() does.
  for (const auto& head : rows.store().heads()) {
    proto::SessionStatus status;
    if (!status.ParseFromString(head.status)) status.Clear();
    fuzz::answers([&] { restore(rows.store().load(head.uid)); });
  }
  for (const auto& kept : rows.store().replies(store::kReplySeconds)) {
    proto::Reply reply;
    if (reply.ParseFromString(kept.reply)) (void)reply.SerializeAsString();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view bytes = fuzz::text_of(data, size);
  if (bytes.starts_with('x')) {
    restore_export(bytes.substr(1));
  } else {
    fuzz::answers([&] { restore_rows(bytes); });
  }
  return 0;
}
