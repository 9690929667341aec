#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/transport/role.h"

namespace limber::server {

/// A client that may connect: its name and its role.
struct Allowed {
  Role role = Role::kEdit;
  std::string name;  // 1 to 64 of [A-Za-z0-9._@-]; empty: none
  bool operator==(const Allowed&) const = default;
};

/// By public key, Z85.
using AllowedKeys = std::map<std::string, Allowed>;

/// Is it a Z85 key of 40 characters?
[[nodiscard]] bool is_curve_key(const std::string& text);

/// The file of clients that may connect: lines `KEY [ROLE [NAME]] [# COMMENT]`. A key without a
/// role may edit. Lines and comments that are not changed stay as they are.
class AllowList {
 public:
  /// @param file  for errors
  /// @throws Error{kInvalidArgument} naming file and line
  AllowList(const std::string& text, const std::string& file);

  struct Entry {
    std::string key;
    Allowed allowed;
  };
  /// In the order of the lines.
  [[nodiscard]] std::vector<Entry> entries() const;
  [[nodiscard]] AllowedKeys keys() const;
  /// By key or by name.
  [[nodiscard]] std::optional<Entry> find(const std::string& key_or_name) const;

  /// Adds it, or puts it in the place of the line with this key.
  /// @throws Error{kInvalidArgument, kAlreadyExists} field "key.key" or "key.name"
  void put(const Entry& entry);
  void remove(const std::string& key);

  [[nodiscard]] std::string text() const;

 private:
  struct Line {
    std::string text;  // the original text
    std::optional<Entry> entry;
    std::string comment;  // from # on
  };
  static Line read_line(const std::string& text, const std::string& place);

  std::vector<Line> lines_;
};

/// @throws Error{kIo, kInvalidArgument} naming the file and line; also if users other than its
/// owner and group may write it
[[nodiscard]] AllowList read_allow_list(const std::filesystem::path& file);

/// Reads, changes and writes it: concurrent readers get all of the old or of the new one, and of
/// two changes neither is lost. On disk when it returns.
/// @param change  its exceptions are passed on, and nothing is written
/// @throws Error{kIo, kInvalidArgument}
AllowList change_allow_list(const std::filesystem::path& file,
                            const std::function<void(AllowList&)>& change);

}  // namespace limber::server
