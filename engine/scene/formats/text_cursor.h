#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace limber::scene::formats {

/// Reads words, numbers and raw bytes from a file in memory and knows the line it is on, so that
/// every complaint can name file and line. Never reads past the end; never allocates by what the
/// file claims.
class TextCursor {
 public:
  TextCursor(std::string_view name, std::string_view text) : name_(name), text_(text) {}

  /// @throws Error{kInvalidArgument} "name:line: message", with the file's name as field.
  [[noreturn]] void fail(const std::string& message) const { fail_at(line_, message); }
  [[noreturn]] void fail_at(std::int64_t line, const std::string& message,
                            ErrorCode code = ErrorCode::kInvalidArgument) const;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::int64_t line() const { return line_; }
  [[nodiscard]] std::size_t remaining() const { return text_.size() - position_; }
  [[nodiscard]] std::size_t position() const { return position_; }

  /// A character that starts a comment running to the end of the line; 0: none.
  void set_comment(char mark) { comment_ = mark; }
  /// Commas count as blanks (Abaqus, VegaFEM).
  void set_comma_separates(bool on) { comma_ = on; }

  /// Skips blanks, line ends and comments. False at the end of the file.
  bool skip_blanks();
  /// Skips blanks but no line end; true if something is left on this line.
  bool skip_blanks_in_line();
  [[nodiscard]] char peek() const { return position_ < text_.size() ? text_[position_] : '\0'; }

  /// The next word (up to a blank), or empty at the end of the file.
  std::string_view word();
  /// The rest of this line without its end, and moves to the next line. False at the end of the
  /// file.
  bool next_line(std::string_view& rest);
  void skip_line();

  /// @param what  the expected item, for the message: "a node id"
  double real(const char* what);
  std::int64_t integer(const char* what);
  /// The same, but refusing to look for it on a later line: a short line is not filled up from the
  /// next.
  double real_in_line(const char* what);
  std::int64_t integer_in_line(const char* what);
  /// A count of things; each needs at least `bytes_each` of the remaining bytes.
  std::int64_t count(const char* what, std::size_t bytes_each);
  /// Refuses a count that the rest of the file cannot hold.
  void check_count(std::int64_t value, const char* what, std::size_t bytes_each) const;
  /// Demands this word (exactly).
  void expect(std::string_view expected);

  /// The next `size` bytes, uninterpreted.
  std::string_view bytes(std::size_t size, const char* what);

 private:
  [[noreturn]] void fail_expected(const char* what);

  std::string name_;
  std::string_view text_;
  std::size_t position_ = 0;
  std::int64_t line_ = 1;
  char comment_ = 0;
  bool comma_ = false;
};

/// Is `a` equal to `b` but for upper and lower case (ASCII)?
[[nodiscard]] bool same_word(std::string_view a, std::string_view b);
[[nodiscard]] std::string to_lower(std::string_view text);
[[nodiscard]] std::string_view trim(std::string_view text);
/// A word for a message: cut to a sensible length, unprintable bytes replaced.
[[nodiscard]] std::string in_quotes(std::string_view text);

}  // namespace limber::scene::formats
