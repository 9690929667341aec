#include "server/cli/access.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "server/transport/allow_list.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

struct ListCommand {
  std::string key, role, name;
  std::filesystem::path file;
};

void print_entry(const AllowList::Entry& entry, const char* what) {
  fmt::print("{} {}{}{}{}\n", entry.key, name_of(entry.allowed.role),
             entry.allowed.name.empty() ? "" : " ", entry.allowed.name, what);
}

int allow_key(const ListCommand& line) {
  // The first key makes the list.
  const int made = ::open(line.file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0600);
  if (made >= 0) ::close(made);
  AllowList::Entry entry{line.key, {role_of(line.role).value_or(Role::kView), line.name}};
  change_allow_list(line.file, [&](AllowList& list) {
    const auto before = list.find(entry.key);
    if (before && entry.allowed.name.empty()) entry.allowed.name = before->allowed.name;
    list.put(entry);
  });
  print_entry(entry, "");
  return 0;
}

int revoke_key(const ListCommand& line) {
  std::optional<AllowList::Entry> entry;
  change_allow_list(line.file, [&](AllowList& list) {
    entry = list.find(line.key);
    if (!entry) {
      throw Refusal(
          proto::ERROR_CODE_NOT_FOUND, "key",
          fmt::format("'{}' is neither a key nor a name in {}", line.key, line.file.string()));
    }
    list.remove(entry->key);
  });
  print_entry(*entry, " is revoked");
  return 0;
}

int list_keys(const ListCommand& line) {
  for (const auto& entry : read_allow_list(line.file).entries()) print_entry(entry, "");
  return 0;
}

}  // namespace

void add_access_commands(CLI::App& app, std::function<int()>& chosen) {
  auto line = std::make_shared<ListCommand>();
  const auto add = [&](const char* name, const char* text, int (*command)(const ListCommand&)) {
    auto* added = app.add_subcommand(name, text);
    added->add_option("--file", line->file, "The list (limberd --curve-allow)")->required();
    added->callback(
        [&chosen, line, command] { chosen = [line, command] { return command(*line); }; });
    return added;
  };
  auto* allow =
      add("allow", "Put a client's public key into a list of keys, with its role", allow_key);
  allow->add_option("key", line->key, "Public key (40 characters)")->required();
  allow->add_option("--role", line->role, "view, edit or administer")
      ->required()
      ->check(CLI::IsMember({"view", "edit", "administer"}));
  allow->add_option("--name", line->name, "Whose it is");
  auto* revoke = add("revoke", "Take a key off a list of keys", revoke_key);
  revoke->add_option("key", line->key, "Public key, or its name in the list")->required();
  add("allowed", "The keys of a list and their roles", list_keys);
}

}  // namespace limber::server
