#include "engine/scene/formats/text_cursor.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace limber::scene::formats {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

/// Length of a byte order mark at the beginning of a text, which some editors write.
std::size_t byte_order_mark(std::string_view text) {
  return text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (lower(a[i]) != lower(b[i])) return false;
  }
  return true;
}

std::string to_lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = lower(c);
  return result;
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && (is_blank(text.front()) || text.front() == '\n')) text.remove_prefix(1);
  while (!text.empty() && (is_blank(text.back()) || text.back() == '\n')) text.remove_suffix(1);
  return text;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result = "'";
  for (char c : text.substr(0, kLongest)) {
    result += (c >= 0x20 && c < 0x7f) ? c : '?';
  }
  return result + (text.size() > kLongest ? "...'" : "'");
}

void TextCursor::fail_at(std::int64_t line, const std::string& message, ErrorCode code) const {
  throw Error(code, name_, name_ + ":" + std::to_string(line) + ": " + message);
}

void TextCursor::fail_expected(const char* what) {
  const std::int64_t line = line_;
  const std::string_view found = word();
  if (found.empty()) fail_at(line, std::string("expected ") + what + ", found the end of the file");
  fail_at(line, std::string("expected ") + what + ", found " + in_quotes(found));
}

bool TextCursor::skip_blanks_in_line() {
  if (position_ == 0) position_ = byte_order_mark(text_);
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (is_blank(c) || (comma_ && c == ',')) {
      ++position_;
    } else if (comment_ && c == comment_) {
      while (position_ < text_.size() && text_[position_] != '\n') ++position_;
      return false;
    } else {
      return c != '\n';
    }
  }
  return false;
}

bool TextCursor::skip_blanks() {
  while (!skip_blanks_in_line()) {
    if (position_ >= text_.size()) return false;
    ++position_;  // the line end
    ++line_;
  }
  return true;
}

std::string_view TextCursor::word() {
  if (!skip_blanks()) return {};
  const std::size_t begin = position_;
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (is_blank(c) || c == '\n' || (comma_ && c == ',')) break;
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

bool TextCursor::next_line(std::string_view& rest) {
  if (position_ == 0) position_ = byte_order_mark(text_);
  if (position_ >= text_.size()) return false;
  const std::size_t end = text_.find('\n', position_);
  if (end == std::string_view::npos) {
    rest = text_.substr(position_);
    position_ = text_.size();
  } else {
    rest = text_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
  }
  if (!rest.empty() && rest.back() == '\r') rest.remove_suffix(1);
  return true;
}

void TextCursor::skip_line() {
  std::string_view ignored;
  next_line(ignored);
}

double TextCursor::real(const char* what) {
  if (!skip_blanks()) fail_expected(what);
  const char* begin = text_.data() + position_;
  const char* const end = text_.data() + text_.size();
  if (*begin == '+' && begin + 1 < end && begin[1] != '-') ++begin;
  double value = 0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc::result_out_of_range) {
    // from_chars does not say which side: underflow is harmless, overflow is not.
    value = std::strtod(std::string(begin, stop).c_str(), nullptr);
  } else if (error != std::errc()) {
    fail_expected(what);
  }
  if (stop < end && !is_blank(*stop) && *stop != '\n' && !(comma_ && *stop == ',') &&
      !(comment_ && *stop == comment_)) {
    fail_expected(what);
  }
  if (!std::isfinite(value)) {
    fail(std::string("expected ") + what + ", found a value that is not finite");
  }
  position_ = static_cast<std::size_t>(stop - text_.data());
  return value;
}

std::int64_t TextCursor::integer(const char* what) {
  if (!skip_blanks()) fail_expected(what);
  const char* begin = text_.data() + position_;
  const char* const end = text_.data() + text_.size();
  if (*begin == '+' && begin + 1 < end && begin[1] != '-') ++begin;
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc()) fail_expected(what);
  if (stop < end && !is_blank(*stop) && *stop != '\n' && !(comma_ && *stop == ',') &&
      !(comment_ && *stop == comment_)) {
    fail_expected(what);
  }
  position_ = static_cast<std::size_t>(stop - text_.data());
  return value;
}

double TextCursor::real_in_line(const char* what) {
  if (!skip_blanks_in_line()) fail(std::string("expected ") + what + ", found the end of the line");
  return real(what);
}

std::int64_t TextCursor::integer_in_line(const char* what) {
  if (!skip_blanks_in_line()) fail(std::string("expected ") + what + ", found the end of the line");
  return integer(what);
}

void TextCursor::check_count(std::int64_t value, const char* what, std::size_t bytes_each) const {
  if (value < 0) fail(std::string(what) + " is negative: " + std::to_string(value));
  // Quadruples of ids are indexed with int throughout.
  if (value > std::numeric_limits<int>::max() / 4 ||
      static_cast<std::uint64_t>(value) > (remaining() + 1) / bytes_each) {
    fail(std::string(what) + " is " + std::to_string(value) +
         ", more than the rest of the file holds");
  }
}

std::int64_t TextCursor::count(const char* what, std::size_t bytes_each) {
  const std::int64_t value = integer(what);
  check_count(value, what, bytes_each);
  return value;
}

void TextCursor::expect(std::string_view expected) {
  if (!skip_blanks()) fail("expected " + in_quotes(expected) + ", found the end of the file");
  const std::int64_t line = line_;
  const std::string_view found = word();
  if (found != expected)
    fail_at(line, "expected " + in_quotes(expected) + ", found " + in_quotes(found));
}

std::string_view TextCursor::bytes(std::size_t size, const char* what) {
  if (size > remaining()) fail(std::string("the file ends inside ") + what);
  const std::string_view result = text_.substr(position_, size);
  position_ += size;
  return result;
}

}  // namespace limber::scene::formats
