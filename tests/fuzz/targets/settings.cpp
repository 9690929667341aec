// What operators write, and what decides who comes in. The first byte chooses:
//   c  a file of --config
//   a  a list of keys that may connect
//   k  a file of a secret key
//   t  a file of the token of pages
//   d  the head of an HTTP request: lines of method, target, host, origin, local address
//   e  an endpoint
//   n  the name of a session, NAME or NAME@UID
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "server/cli/config_file.h"
#include "server/runtime/run.h"
#include "server/transport/allow_list.h"
#include "server/transport/curve.h"
#include "server/transport/endpoint.h"
#include "server/web/door.h"
#include "server/web/headers.h"
#include "server/web/options.h"
#include "server/web/token.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;

constexpr const char* kFile = "settings";

bool is_plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// Options of every form that those of limberd have.
struct Program {
  Program() {
    app.set_config("--config", kFile);
    app.add_option("--bind", text)->capture_default_str();
    app.add_option("--web-host", texts)->allow_extra_args(false);  // as all that are repeatable
    app.add_option("--threads", count)->capture_default_str();
    app.add_option("--drain-seconds", number)->capture_default_str();
    app.add_flag("--no-cache", flag);
  }
  /// As the command line would have them. @returns whether they are values of these options
  bool take(const std::vector<CLI::ConfigItem>& items) {
    try {
      for (const auto& item : items) {
        CLI::Option* option = app.get_option("--" + item.name);
        for (const std::string& input : item.inputs) option->add_result(input);
        option->run_callback();
      }
      return true;
    } catch (const CLI::ParseError&) {
      return false;
    }
  }
  CLI::App app;
  std::string text = "tcp://127.0.0.1:5555";
  std::vector<std::string> texts;
  unsigned count = 2;
  double number = 10;
  bool flag = false;
};

using Values = std::map<std::string, std::vector<std::string>>;

/// @throws CLI::ConfigError
Values read(const server::ConfigFile& file, const std::string& text, Program* program = nullptr) {
  std::istringstream in(text);
  const auto items = file.from_config(in);
  Values values;
  for (const auto& item : items) values.emplace(item.name, item.inputs);
  if (program != nullptr && !program->take(items)) values.clear();
  return values;
}

void read_config(const std::string& text) {
  Program program;
  const server::ConfigFile file(program.app);
  Values values;
  try {
    values = read(file, text, &program);
  } catch (const CLI::ConfigError& error) {
    if (*error.what() == '\0') fuzz::finding("an error without a message");
    return;
  }
  if (values.empty()) return;
  try {
    if (read(file, file.to_config(&program.app, false, false, {})) != values)
      fuzz::finding("options that were written are not read as they were");
  } catch (const CLI::ConfigError& error) {
    fuzz::finding(error.what());
  }
}

void read_keys(const std::string& text) {
  server::AllowList list(text, kFile);
  const auto entries = list.entries();
  if (server::AllowList(list.text(), kFile).keys() != list.keys())
    fuzz::finding("a list of keys that was written is not read as it was");
  for (const auto& entry : entries) {
    if (!is_plain(entry.key)) fuzz::finding("a key that cannot be written");
    if (!list.find(entry.key)) fuzz::finding("a key of the list is not found");
  }
  if (entries.empty()) return;
  server::AllowList::Entry other = entries.front();
  other.allowed = {server::Role::kView, "fuzz"};
  fuzz::answers([&] {
    list.put(other);
    if (server::AllowList(list.text(), kFile).keys().at(other.key) != other.allowed)
      fuzz::finding("a key that was put into the list is not in it");
  });
  list.remove(other.key);
  if (server::AllowList(list.text(), kFile).find(other.key))
    fuzz::finding("a key that was removed is in the list");
}

void judge(std::string_view text) {
  static const std::string token = "0123456789abcdef";
  static const server::web::Door door(token, {"studio", "10.0.0.7"});
  server::web::Visit visit;
  for (auto* part :
       {&visit.method, &visit.target, &visit.host, &visit.origin, &visit.local_address})
    *part = fuzz::take_until(text, "\n");
  visit.is_upgrade = text.starts_with('u');
  visit.has_many_origins = text.ends_with('m');
  const server::web::Verdict verdict = door.judge(visit);
  using Way = server::web::Verdict::Way;
  if (verdict.way == Way::kRefused) {
    if (verdict.text.empty()) fuzz::finding("a refusal without a text");
    return;
  }
  if (verdict.way == Way::kFile && !verdict.path.starts_with('/'))
    fuzz::finding("a file that is no path");
  if (verdict.way == Way::kRequests || verdict.way == Way::kStream) {
    const auto shown = server::web::query_value(visit.target, "token");
    if (door.tokens().role_of(shown) != verdict.role) fuzz::finding("a page without a token");
  }
  for (const auto& [name, value] : server::web::security_headers(visit.host, {})) {
    if (std::any_of(value.begin(), value.end(), [](unsigned char c) { return std::iscntrl(c); }))
      fuzz::finding("a header that a visitor can end");
  }
}

void read_endpoint(const std::string& text) {
  if (server::reach_of(text, "--bind") == server::Reach::kLoopback)
    (void)server::reach_of(server::for_bind(text), "--bind");
  server::web::Options options;
  options.address = text;
  options.hosts = {text};
  options.frame_ancestors = {text};
  options.validate();
}

void read_settings(char reader, std::string_view text) {
  switch (reader) {
    case 'c':
      return read_config(std::string(text));
    case 'a':
      return read_keys(std::string(text));
    case 'k':
      if (!is_plain(server::curve_key_of(std::string(text), kFile)))
        fuzz::finding("a key that cannot be written");
      return;
    case 't':
      if (!is_plain(server::web::token_of(std::string(text), kFile)))
        fuzz::finding("a token that no address can have");
      return;
    case 'd':
      return judge(text);
    case 'e':
      return read_endpoint(std::string(text));
    case 'n': {
      const auto key = server::SessionKey::parse(std::string(text));
      if (key.uid != 0 && server::SessionKey::parse(key.reference()).uid != key.uid)
        fuzz::finding("a session's reference that is not read as it was");
      return;
    }
    default:
      return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  if (!text.empty()) fuzz::answers([&] { read_settings(text.front(), text.substr(1)); });
  return 0;
}
