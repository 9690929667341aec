#include "server/transport/allow_list.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kKeyDigits = 40, kLongestName = 64;
constexpr const char* kBlanks = " \t\r";

bool is_name(const std::string& text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '.' || c == '_' || c == '@' || c == '-';
         });
}

/// Takes the first word off the rest of a line.
std::string take_word(std::string& rest) {
  const auto first = rest.find_first_not_of(kBlanks);
  if (first == std::string::npos) return {};
  const auto end = std::min(rest.size(), rest.find_first_of(kBlanks, first));
  std::string word = rest.substr(first, end - first);
  rest.erase(0, end);
  return word;
}

std::string written(const AllowList::Entry& entry) {
  std::string text = fmt::format("{} {}", entry.key, name_of(entry.allowed.role));
  if (!entry.allowed.name.empty()) text += " " + entry.allowed.name;
  return text;
}

Error io_fault(const fs::path& file, const char* what) {
  return {ErrorCode::kIo, file.string(), fmt::format("{} {}", file.string(), what)};
}

/// Closed at its end; so is the lock on it.
class File {
 public:
  File(const fs::path& path, int flags, mode_t mode = 0)
      : number_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (number_ >= 0) ::close(number_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool is_open() const { return number_ >= 0; }

 private:
  int number_;
};

bool write_all(const File& file, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const auto now = ::write(file.number(), text.data() + done, text.size() - done);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) return false;
    done += static_cast<std::size_t>(now);
  }
  return ::fsync(file.number()) == 0;
}

void replace_file(const fs::path& file, const File& folder, const std::string& text) {
  struct stat old {};
  if (::stat(file.c_str(), &old) != 0) throw io_fault(file, "cannot be read");
  const fs::path aside = fmt::format("{}.{}", file.string(), ::getpid());
  ::unlink(aside.c_str());
  bool is_written = false;
  {
    const File out(aside, O_WRONLY | O_CREAT | O_EXCL, 0600);
    is_written = out.is_open() && write_all(out, text);
    if (is_written) {
      // If the owner cannot be kept, the mode still is: the file then belongs to the editing user.
      [[maybe_unused]] const int owner = ::fchown(out.number(), old.st_uid, old.st_gid);
      is_written = ::fchmod(out.number(), old.st_mode & 07777) == 0;
    }
  }
  if (!is_written || ::rename(aside.c_str(), file.c_str()) != 0) {
    ::unlink(aside.c_str());
    throw io_fault(file, "cannot be written: it is as it was");
  }
  ::fsync(folder.number());
}

}  // namespace

bool is_curve_key(const std::string& text) {
  std::array<std::uint8_t, 32> raw{};
  // libzmq reads up to a zero byte.
  return text.size() == kKeyDigits && text.find('\0') == std::string::npos &&
         zmq_z85_decode(raw.data(), text.c_str()) != nullptr;
}

/// '#' is a Z85 digit too: the first word is a key where it can be one.
AllowList::Line AllowList::read_line(const std::string& text, const std::string& place) {
  Line line{text, {}, {}};
  std::string rest = text;
  const std::string key = take_word(rest);
  if (!is_curve_key(key)) {
    if (key.empty() || key.front() == '#') return line;
    throw Error(ErrorCode::kInvalidArgument, place, "is not a Z85 public key of 40 characters");
  }
  const auto comment = rest.find('#');
  if (comment != std::string::npos) line.comment = rest.substr(comment);
  rest.resize(std::min(rest.size(), comment));
  Entry entry{key, {}};
  if (const std::string word = take_word(rest); !word.empty()) {
    const auto role = role_of(word);
    if (!role) {
      throw Error(ErrorCode::kInvalidArgument, place,
                  fmt::format("'{}' is no role: behind a key stands view, edit or administer, or a "
                              "comment that begins with #",
                              word));
    }
    entry.allowed.role = *role;
  }
  entry.allowed.name = take_word(rest);
  if (!entry.allowed.name.empty() && !is_name(entry.allowed.name)) {
    throw Error(ErrorCode::kInvalidArgument, place,
                fmt::format("a name is 1 to {} of A-Z a-z 0-9 . _ @ -", kLongestName));
  }
  if (const std::string more = take_word(rest); !more.empty()) {
    throw Error(ErrorCode::kInvalidArgument, place,
                fmt::format("'{}' behind key, role and name: comments begin with #", more));
  }
  line.entry = std::move(entry);
  return line;
}

AllowList::AllowList(const std::string& text, const std::string& file) {
  std::istringstream in(text);
  AllowedKeys met;
  std::map<std::string, std::string> named;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string place = fmt::format("{}:{}", file, number);
    lines_.push_back(read_line(line, place));
    const auto& entry = lines_.back().entry;
    if (!entry) continue;
    const auto [before, fresh] = met.try_emplace(entry->key, entry->allowed);
    if (!fresh && before->second != entry->allowed)
      throw Error(ErrorCode::kInvalidArgument, place, "the key is given before, otherwise");
    if (entry->allowed.name.empty()) continue;
    if (named.try_emplace(entry->allowed.name, entry->key).first->second != entry->key)
      throw Error(ErrorCode::kInvalidArgument, place, "another key has this name");
  }
}

std::vector<AllowList::Entry> AllowList::entries() const {
  std::vector<Entry> entries;
  for (const Line& line : lines_) {
    if (line.entry) entries.push_back(*line.entry);
  }
  return entries;
}

AllowedKeys AllowList::keys() const {
  AllowedKeys keys;
  for (const Entry& entry : entries()) keys.insert_or_assign(entry.key, entry.allowed);
  return keys;
}

std::optional<AllowList::Entry> AllowList::find(const std::string& key_or_name) const {
  const bool is_key = is_curve_key(key_or_name);
  for (const Line& line : lines_) {
    if (!line.entry || key_or_name.empty()) continue;
    if ((is_key ? line.entry->key : line.entry->allowed.name) == key_or_name) return line.entry;
  }
  return std::nullopt;
}

void AllowList::put(const Entry& entry) {
  if (!is_curve_key(entry.key))
    throw Error(ErrorCode::kInvalidArgument, "key.key", "is not a Z85 public key of 40 characters");
  const std::string& name = entry.allowed.name;
  if (!name.empty()) {
    if (!is_name(name)) {
      throw Error(ErrorCode::kInvalidArgument, "key.name",
                  fmt::format("a name is 1 to {} of A-Z a-z 0-9 . _ @ -", kLongestName));
    }
    const auto other = find(name);
    if (other && other->key != entry.key)
      throw Error(ErrorCode::kAlreadyExists, "key.name",
                  fmt::format("another key has the name '{}'", name));
  }
  bool is_there = false;
  for (Line& line : lines_) {
    if (!line.entry || line.entry->key != entry.key) continue;
    line.entry = entry;
    line.text = written(entry) + (line.comment.empty() ? "" : " " + line.comment);
    is_there = true;
  }
  if (!is_there) lines_.push_back({written(entry), entry, {}});
}

void AllowList::remove(const std::string& key) {
  lines_.erase(
      std::remove_if(lines_.begin(), lines_.end(),
                     [&](const Line& line) { return line.entry && line.entry->key == key; }),
      lines_.end());
}

std::string AllowList::text() const {
  std::string text;
  for (const Line& line : lines_) text += line.text + "\n";
  return text;
}

AllowList read_allow_list(const fs::path& file) {
  const std::string text = scene::read_bytes(file);
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) != 0) {
    throw Error(ErrorCode::kInvalidArgument, file.string(),
                fmt::format("everybody may write this list of keys: chmod o-w {}", file.string()));
  }
  return {text, file.string()};
}

AllowList change_allow_list(const fs::path& given, const std::function<void(AllowList&)>& change) {
  std::error_code missing;
  const fs::path file = fs::canonical(given, missing);  // a link stays one
  if (missing) throw io_fault(given, "cannot be read");
  const File folder(file.parent_path(), O_RDONLY | O_DIRECTORY);
  if (!folder.is_open() || ::flock(folder.number(), LOCK_EX) != 0)
    throw io_fault(file.parent_path(), "cannot be locked");
  AllowList list = read_allow_list(file);
  const std::string before = list.text();
  change(list);
  if (list.text() != before) replace_file(file, folder, list.text());
  return list;
}

}  // namespace limber::server
