#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace limber::server::web {

struct File {
  std::string_view bytes;
  std::shared_ptr<const std::string> owner;  // of the bytes; null: they are the program's
  std::string type;                          // Content-Type
  std::string tag;                           // ETag; empty: none, it may change at any time
};

/// The files of pages: compiled in, or from a folder during development. Thread-safe.
class Files {
 public:
  /// @param root  empty: those compiled in
  explicit Files(const std::filesystem::path& root);

  /// @param path  begins with /; / itself is /index.html. Nothing outside of the folder is found,
  ///              nor what begins with a dot.
  [[nodiscard]] std::optional<File> find(std::string_view path) const;

 private:
  [[nodiscard]] std::optional<File> read(std::string_view path) const;

  std::filesystem::path root_;  // canonical
  std::map<std::string, File, std::less<>> compiled_in_;
};

/// By the ending of a name.
[[nodiscard]] std::string content_type(std::string_view name);

}  // namespace limber::server::web
