#include "server/cli/config_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <istream>
#include <set>
#include <sstream>
#include <string_view>

namespace limber::server {
namespace {

bool is_bare(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
}

bool is_of_number(char c) { return is_bare(c) || c == '.' || c == '+'; }

/// Can it be one, without quotes?
bool begins_number(std::string_view word) {
  return !word.empty() && (std::isdigit(static_cast<unsigned char>(word[0])) != 0 ||
                           word[0] == '-' || word[0] == '+');
}

constexpr std::size_t kMostBytes = 1 << 20;  // of a file

/// The file's content, cut off just beyond the largest allowed size.
std::string begin_of(std::istream& in) {
  std::string text(kMostBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

/// Reads a file from its beginning to its end.
class Reader {
 public:
  Reader(std::string text, std::string file) : text_(std::move(text)), file_(std::move(file)) {
    if (text_.size() > kMostBytes)
      throw CLI::ConfigError(
          fmt::format("{}: more than {} bytes are no configuration", file_, kMostBytes));
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // that some editors write
    if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
  }

  /// @returns false at the end
  bool to_next_option() {
    skip_lines();
    return !at_end();
  }
  std::string name() {
    if (peek() == '[')
      fail("there are no tables here: all options are at the top, and before a value stands = ");
    const std::size_t begin = at_;
    while (is_bare(peek())) ++at_;
    if (at_ == begin) fail("a line is OPTION = VALUE");
    std::string name = text_.substr(begin, at_ - begin);
    skip_blanks();
    if (peek() != '=') fail(fmt::format("after '{}' comes = and a value", name));
    ++at_;
    skip_blanks();
    return name;
  }
  std::vector<std::string> values() {
    std::vector<std::string> values;
    if (peek() == '[') {
      ++at_;
      for (skip_lines(); peek() != ']'; skip_lines()) {
        if (!values.empty()) {
          if (peek() != ',') fail("between the values of an array stands a comma");
          ++at_;
          skip_lines();
          if (peek() == ']') break;
        }
        values.push_back(value());
      }
      ++at_;
    } else {
      values.push_back(value());
    }
    skip_blanks();
    if (peek() == '#') skip_comment();
    if (!at_end() && peek() != '\n' && peek() != '\r') fail("nothing may stand behind a value");
    return values;
  }
  [[noreturn]] void fail(const std::string& what) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<long>(at_), '\n');
    throw CLI::ConfigError(fmt::format("{}:{}: {}", file_, line, what));
  }

 private:
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : text_[at_]; }
  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t') ++at_;
  }
  void skip_comment() {
    while (!at_end() && peek() != '\n') ++at_;
  }
  void skip_lines() {
    while (!at_end()) {
      if (peek() == '#') {
        skip_comment();
      } else if (std::isspace(static_cast<unsigned char>(peek())) != 0) {
        ++at_;
      } else {
        return;
      }
    }
  }
  std::string value() {
    if (peek() == '"') return basic_string();
    if (peek() == '\'') return literal_string();
    const std::size_t begin = at_;
    while (is_of_number(peek())) ++at_;
    std::string word = text_.substr(begin, at_ - begin);
    if (word == "true" || word == "false") return word;
    if (!begins_number(word)) fail("a value is a number, true, false, or text in quotes");
    word.erase(std::remove(word.begin(), word.end(), '_'), word.end());
    return word;
  }
  std::string literal_string() {
    const std::size_t end = text_.find_first_of("'\n", at_ + 1);
    if (end == std::string::npos || text_[end] != '\'') fail("a quote is not closed on its line");
    std::string text = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return text;
  }
  std::string basic_string() {
    std::string text;
    for (++at_; peek() != '"'; ++at_) {
      if (at_end() || peek() == '\n') fail("a quote is not closed on its line");
      if (peek() != '\\') {
        text += peek();
        continue;
      }
      ++at_;
      switch (peek()) {
        case '"':
        case '\\':
          text += peek();
          break;
        case 'n':
          text += '\n';
          break;
        case 't':
          text += '\t';
          break;
        default:
          fail("after \\ in a text comes \", \\, n or t; in single quotes it is itself");
      }
    }
    ++at_;
    return text;
  }

  const std::string text_, file_;
  std::size_t at_ = 0;
};

/// Options of the long names that a file may have.
bool is_of_files(const CLI::Option& option) {
  return option.get_configurable() && !option.get_lnames().empty();
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string as_value(const CLI::Option& option, const std::string& text) {
  const std::string type = option.get_type_name();
  const bool is_number =
      type.starts_with("UINT") || type.starts_with("INT") || type.starts_with("FLOAT");
  const bool is_word = text == "true" || text == "false";
  // Numbers that the command line accepts but this reader does not are quoted: .5, inf.
  const bool is_bare_number = is_number && begins_number(text) && text.find('_') == text.npos &&
                              std::all_of(text.begin(), text.end(), is_of_number);
  return is_word || is_bare_number ? text : quoted(text);
}

std::string value_of(const CLI::Option& option) {
  const bool is_flag = option.get_expected_min() == 0;
  std::vector<std::string> values;
  const auto results = option.count() > 0 ? option.results() : std::vector<std::string>{};
  for (const std::string& text : results) values.push_back(as_value(option, text));
  if (option.get_items_expected_max() > 1) return fmt::format("[{}]", fmt::join(values, ", "));
  if (is_flag && !results.empty() && results.back().empty())
    return "true";  // given without a value
  if (!values.empty()) return values.back();
  if (is_flag && option.get_default_str().empty()) return "false";
  return as_value(option, option.get_default_str());
}

void append_wrapped(std::string& out, const std::string& text) {
  constexpr std::size_t kWidth = 98;
  std::istringstream words(text);
  std::string line = "#", word;
  while (words >> word) {
    if (line.size() + 1 + word.size() > kWidth) {
      out += line + '\n';
      line = "#";
    }
    line += ' ' + word;
  }
  out += line + '\n';
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& in) const {
  const std::string file = app_.get_config_ptr()->as<std::string>();
  Reader reader(begin_of(in), file);
  std::vector<CLI::ConfigItem> given;
  std::set<std::string> known;
  while (reader.to_next_option()) {
    CLI::ConfigItem item;
    item.name = reader.name();
    const CLI::Option* option = app_.get_option_no_throw("--" + item.name);
    if (option == nullptr || !is_of_files(*option))
      reader.fail(
          fmt::format("there is no option '{}' (limberd --print-config shows all)", item.name));
    if (!known.insert(item.name).second) reader.fail(fmt::format("'{}' comes twice", item.name));
    item.inputs = reader.values();
    if (item.inputs.size() > 1 && option->get_items_expected_max() <= 1)
      reader.fail(fmt::format("'{}' has one value", item.name));
    if (!item.inputs.empty()) given.push_back(std::move(item));
  }
  return given;
}

std::string ConfigFile::to_config(const CLI::App* app, bool, bool, std::string) const {
  std::vector<std::string> groups;
  for (const CLI::Option* option : app->get_options()) {
    const bool is_new =
        std::find(groups.begin(), groups.end(), option->get_group()) == groups.end();
    if (is_of_files(*option) && is_new) groups.push_back(option->get_group());
  }
  std::string out =
      "# Options of limberd, by their names on the command line, which wins over this file. What "
      "is "
      "at\n# its default is a comment.\n";
  for (const std::string& group : groups) {
    out += fmt::format("\n# --- {}\n", group == "Options" ? "More" : group);
    for (const CLI::Option* option : app->get_options()) {
      if (!is_of_files(*option) || option->get_group() != group) continue;
      out += '\n';
      append_wrapped(out, option->get_description());
      out += fmt::format("{}{} = {}\n", option->count() > 0 ? "" : "#",
                         option->get_lnames().front(), value_of(*option));
    }
  }
  return out;
}

std::map<std::string, std::string> ConfigFile::values(const CLI::App& app) {
  std::map<std::string, std::string> values;
  for (const CLI::Option* option : app.get_options()) {
    if (is_of_files(*option)) values.emplace(option->get_lnames().front(), value_of(*option));
  }
  return values;
}

}  // namespace limber::server
