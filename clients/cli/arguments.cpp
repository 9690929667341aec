#include "clients/cli/arguments.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <limits>

#include "clients/cli/export_formats.h"

namespace limber::cli {
namespace {

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool is_node(const std::string& word) { return std::all_of(word.begin(), word.end(), is_digit); }

bool is_format(const std::string& word) { return kExportFormats.count(word) > 0; }

bool is_option(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && !is_digit(word[1]) && word[1] != '.';
}

bool is_any(const std::string& /*word*/) { return true; }

/// An option that takes several values: at most so many, of which the first is not checked.
struct Several {
  const char* name;
  bool (*is_value)(const std::string&);
  std::size_t most;
};
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

const std::vector<Several>& options_of(const std::string& command) {
  static const std::vector<Several> kConstraint = {{"--node", is_node, kAll},
                                                   {"--nodes", is_node, kAll},
                                                   {"--position", is_any, 3},
                                                   {"--displacement", is_any, 3}};
  static const std::vector<Several> kExport = {{"--format", is_format, kAll}};
  static const std::vector<Several> kRemove = {{"--remove", is_node, kAll}};
  static const std::vector<Several> kNone;
  if (command == "add" || command == "replace") return kConstraint;
  if (command == "keyframe" || command == "attach") return kRemove;
  return command == "export" ? kExport : kNone;
}

std::vector<std::string> with_positionals_first(const std::vector<Several>& options,
                                                const std::vector<std::string>& words) {
  std::vector<std::string> first, rest;
  for (std::size_t at = 0; at < words.size();) {
    const std::string word = words[at++];
    rest.push_back(word);
    const auto option = std::find_if(options.begin(), options.end(), [&](const Several& several) {
      return word.substr(0, word.find('=')) == several.name;
    });
    if (option == options.end()) continue;
    std::size_t values = word.find('=') == std::string::npos ? 0 : 1;
    bool ended = false;
    for (; at < words.size() && !is_option(words[at]); ++at, ++values) {
      ended = ended || values >= option->most || (values > 0 && !option->is_value(words[at]));
      (ended ? first : rest).push_back(words[at]);
    }
  }
  first.insert(first.end(), rest.begin(), rest.end());
  return first;
}

/// A key may begin with '-': of `allow` and `revoke` it goes behind everything else.
void mark_key(std::vector<std::string>& arguments) {
  constexpr std::size_t kKeyLength = 40;
  const auto is_command = [](const std::string& word) {
    return word == "allow" || word == "revoke";
  };
  const auto command = std::find_if(arguments.begin(), arguments.end(), is_command);
  const auto key = std::find_if(command, arguments.end(), [](const std::string& word) {
    return word.size() == kKeyLength && word[0] == '-' && word[1] != '-';
  });
  if (key == arguments.end()) return;
  const std::string text = *key;
  arguments.erase(key);
  arguments.insert(arguments.end(), {"--", text});
}

}  // namespace

std::vector<std::string> as_meant(std::vector<std::string> arguments) {
  mark_key(arguments);
  for (auto& argument : arguments) {
    if (argument.size() > 2 && argument.starts_with("-.") && is_digit(argument[2]))
      argument.insert(argument.begin() + 1, '0');
    // To CLI11 these are options -i, -n, -f; limberd says that they are not finite.
    if (argument == "-inf" || argument == "-infinity") argument = "-1e9999";
    if (argument == "-nan") argument = "nan";
  }
  const auto command =
      std::find_if(arguments.begin(), arguments.end(),
                   [](const std::string& argument) { return !options_of(argument).empty(); });
  if (command == arguments.end()) return arguments;
  const auto words = with_positionals_first(options_of(*command), {command + 1, arguments.end()});
  std::copy(words.begin(), words.end(), command + 1);
  return arguments;
}

}  // namespace limber::cli
