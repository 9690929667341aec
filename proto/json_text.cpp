#include "proto/json_text.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>
#include <vector>

namespace limber::json {
namespace {

constexpr const char* kNoSuchField = "there is no such field";
constexpr int kMaxLevels = 100;  // of objects and arrays in each other

bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

/// `fixed_nodes` as `fixedNodes`. Only what can be a field: keys of maps are file names.
std::string one_spelling(std::string_view key) {
  const bool is_field = std::all_of(key.begin(), key.end(), [](char c) {
    return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0;
  });
  if (!is_field) return std::string(key);
  std::string spelling;
  bool after_underscore = false;
  for (const char c : key) {
    if (c != '_')
      spelling +=
          after_underscore ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    after_underscore = c == '_';
  }
  return spelling;
}

/// Walks a text as protobuf sees it: quotes may be single and keys bare. What is not well formed
/// ends the walk somewhere: protobuf says why.
class KeyWalk {
 public:
  explicit KeyWalk(std::string_view text) : text_(text) {}

  void walk() { value("", 0); }

  /// The path of the first key that is given twice, or nothing.
  [[nodiscard]] const std::optional<std::string>& repeated() const { return found_; }
  /// Where the first comma is that nothing follows, or nothing.
  [[nodiscard]] std::optional<std::size_t> dangling() const { return dangling_; }

 private:
  [[nodiscard]] char peek() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool take(char wanted) {
    if (peek() != wanted) return false;
    ++at_;
    return true;
  }

  void take_comma() {
    if (!take(',')) return;
    const std::size_t comma = at_ - 1;
    const char next = peek();
    if (!dangling_ && (next == '}' || next == ']')) dangling_ = comma;
  }

  std::string_view quoted(char quote) {
    const std::size_t begin = ++at_;
    while (at_ < text_.size() && text_[at_] != quote) at_ += text_[at_] == '\\' ? 2 : 1;
    at_ = std::min(at_, text_.size());
    const std::string_view inside = text_.substr(begin, at_ - begin);
    if (at_ < text_.size()) ++at_;
    return inside;
  }
  std::string_view bare() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]) &&
           std::string_view(",:[]{}").find(text_[at_]) == std::string_view::npos)
      ++at_;
    return text_.substr(begin, at_ - begin);
  }
  std::string_view word() {
    const char first = peek();
    return first == '"' || first == '\'' ? quoted(first) : bare();
  }

  void value(const std::string& path, int depth) {
    constexpr int kMaxDepth = 128;  // protobuf reads no more than 100
    if (depth > kMaxDepth) {
      at_ = text_.size();
    } else if (take('{')) {
      object(path, depth);
    } else if (take('[')) {
      for (int index = 0; !found_ && !take(']') && at_ < text_.size(); ++index) {
        value(path + "[" + std::to_string(index) + "]", depth + 1);
        take_comma();
      }
    } else {
      (void)peek();
      const std::size_t before = at_;
      (void)word();
      if (at_ == before) at_ = text_.size();  // not even an empty string
    }
  }

  void object(const std::string& path, int depth) {
    std::set<std::string> keys;
    while (!found_ && !take('}') && at_ < text_.size()) {
      const std::string_view key = word();
      const std::string inside = path.empty() ? std::string(key) : path + "." + std::string(key);
      if (!keys.insert(one_spelling(key)).second) found_ = inside;
      take(':');
      if (!found_) value(inside, depth + 1);
      take_comma();
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::optional<std::string> found_;
  std::optional<std::size_t> dangling_;
};

/// Where objects and arrays are nested deeper than `most` levels. protobuf goes no deeper into
/// messages, but into what it is going to refuse it does, in a time that grows with the square.
std::optional<std::size_t> too_deep(std::string_view text, int most) {
  int depth = 0;
  char quote = '\0';
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != '\0') {
      if (c == '\\') ++at;
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '{' || c == '[') {
      if (++depth > most) return at;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return std::nullopt;
}

/// "line 3 column 7", both from 1.
std::string place(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t begin = before.rfind('\n') + 1;  // npos + 1 is 0
  return "line " + std::to_string(line) + " column " + std::to_string(at - begin + 1);
}

bool remove_suffix(std::string& text, std::string_view suffix) {
  if (!text.ends_with(suffix)) return false;
  text.resize(text.size() - suffix.size());
  return true;
}

/// Protobuf's sentences: "(frames): invalid value 1.5 for type TYPE_UINT32", "fram: Cannot find
/// field.", "(linkage) sektion: Cannot find field.", ": Root element must be a message.", or a
/// parse error with the place on lines of its own.
Fault fault_of(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  text.erase(
      std::unique(text.begin(), text.end(), [](char a, char b) { return a == ' ' && b == ' '; }),
      text.end());
  while (!text.empty() && (text.back() == ' ' || text.back() == '^')) text.pop_back();
  Fault fault;
  if (const auto colon = text.find(": "); colon != std::string::npos) {
    std::string field = text.substr(0, colon);
    if (field.starts_with('(') && field.ends_with(')')) field = field.substr(1, field.size() - 2);
    if (const auto end = field.find(") "); field.starts_with('(') && end != std::string::npos)
      field = field.substr(1, end - 1) + "." + field.substr(end + 2);
    if (field.find(' ') == std::string::npos) {
      fault.field = field;
      text.erase(0, colon + 2);
    }
  }
  if (text == "Root element must be a message.") text = "a JSON object is expected: {...}";
  if (remove_suffix(text, "Cannot find field.")) text = kNoSuchField;
  if (const auto type = text.find(" for type "); type != std::string::npos) {
    const std::string name = text.substr(type + 10);
    text.resize(type);
    if (name.starts_with("TYPE_UINT")) text += ", a whole number >= 0 is expected";
    if (name.starts_with("TYPE_DOUBLE")) text += ", a number is expected";
    if (const auto dot = name.rfind('.'); dot != std::string::npos)
      text += ", which is no " + name.substr(dot + 1);
  }
  fault.message = text;
  return fault;
}

/// Letters to insert, remove or replace; protobuf's keys are short.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, replaced});
    }
  }
  return row.back();
}

/// The field of the message at the path ("beams.structure.loads[2].forse") that its last name most
/// likely means; empty where the path leads to no message or no field is near.
std::string nearest_field(const google::protobuf::Message& message, std::string_view path) {
  const auto* type = message.GetDescriptor();
  while (true) {
    const std::size_t dot = path.find('.');
    const std::string_view name = path.substr(0, dot);
    if (dot == std::string_view::npos) break;
    const auto* const field = type->FindFieldByName(std::string(name.substr(0, name.find('['))));
    if (field == nullptr || field->message_type() == nullptr) return {};
    type = field->message_type();
    path.remove_prefix(dot + 1);
  }
  std::string nearest;
  std::size_t least = path.size() + 1;
  for (int i = 0; i < type->field_count() && path.size() < 100; ++i) {
    const std::string& name = type->field(i)->name();
    const std::size_t away = edit_distance(one_spelling(path), one_spelling(name));
    // At most a third of the letters differ.
    if (away >= least || 3 * away > std::max(path.size(), name.size())) continue;
    least = away;
    nearest = name;
  }
  return nearest;
}

/// Whoever writes nodes or elements at the top means a structure of beams: scenes have no such
/// fields.
bool is_structure(std::string_view text) {
  google::protobuf::Struct document;
  if (!google::protobuf::util::JsonStringToMessage(std::string(text), &document).ok()) return false;
  const auto& fields = document.fields();
  return fields.contains("nodes") || fields.contains("elements");
}

}  // namespace

std::optional<Fault> read_message(std::string_view text, google::protobuf::Message& message) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte order mark
  if (const auto at = too_deep(text, kMaxLevels))
    return Fault{
        "", "nested deeper than " + std::to_string(kMaxLevels) + " levels at " + place(text, *at)};
  const auto status =
      google::protobuf::util::JsonStringToMessage({text.data(), text.size()}, &message);
  // Asked first: of some fields protobuf refuses the second value, in words of its own.
  KeyWalk walk(text);
  walk.walk();
  if (const auto& field = walk.repeated()) return Fault{*field, "given twice"};
  if (!status.ok()) {
    Fault fault = fault_of(std::string(status.message()));
    if (fault.message == kNoSuchField) {
      const std::string meant = nearest_field(message, fault.field);
      if (!meant.empty()) fault.message += ": did you mean " + meant + "?";
    }
    return fault;
  }
  if (const auto comma = walk.dangling())
    return Fault{"", "not JSON: nothing follows the comma at " + place(text, *comma)};
  return std::nullopt;
}

std::optional<Fault> read_scene(std::string_view text, google::protobuf::Message& scene) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const auto fault = read_message(text, scene);
  if (!fault || too_deep(text, kMaxLevels) || !is_structure(text)) return fault;
  scene.Clear();
  return read_message(R"({"beams": {"structure": )" + std::string(text) + "}}", scene);
}

}  // namespace limber::json
