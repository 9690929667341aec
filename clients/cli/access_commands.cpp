// allow, revoke, allowed: permissions on a server with CURVE keys.

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/limberd.h"
#include "clients/cli/print.h"
#include "clients/cpp/access.h"
#include "clients/cpp/curve_keys.h"

namespace limber::cli {
namespace {

const std::map<std::string, v1::Role> kRoles = {
    {"view", v1::ROLE_VIEW}, {"edit", v1::ROLE_EDIT}, {"administer", v1::ROLE_ADMINISTER}};

struct AccessOptions {
  std::string key, role, name;
  std::string file;  // the list itself, in place of a server
};

std::string described(const v1::AllowedKey& key) {
  return fmt::format("{} {}{}", key.key(), role_words(key.role()),
                     key.name().empty() ? "" : " " + key.name());
}

void allow(Context& context, const AccessOptions& options) {
  const std::string key = client::public_key(options.key, "key");
  if (!options.file.empty()) {
    std::vector<std::string> arguments{"allow", "--role", options.role, "--file", options.file};
    if (!options.name.empty()) arguments.insert(arguments.end(), {"--name", options.name});
    arguments.insert(arguments.end(), {"--", key});  // it may begin with -
    become_limberd(std::move(arguments));
  }
  const auto response = client::allow(context.client(), key, kRoles.at(options.role), options.name);
  if (context.json) return print_json(response);
  fmt::print("{}\n", described(response.key()));
  if (response.has_before() && response.before().role() != response.key().role())
    fmt::print("(it was {} before)\n", role_words(response.before().role()));
}

void revoke(Context& context, const AccessOptions& options) {
  const std::string key =
      client::is_key_file(options.key) ? client::public_key(options.key, "key") : options.key;
  if (!options.file.empty()) become_limberd({"revoke", "--file", options.file, "--", key});
  const auto response = client::revoke(context.client(), key);
  if (context.json) return print_json(response);
  fmt::print("{} is revoked\n", described(response.key()));
}

void list(Context& context, const AccessOptions& options) {
  if (!options.file.empty()) become_limberd({"allowed", "--file", options.file});
  const auto response = client::list_allowed(context.client());
  if (context.json) return print_json(response);
  Table table({"key", "role", "name"});
  for (const auto& key : response.keys())
    table.add({key.key(), role_words(key.role()), key.name()});
  fmt::print("{}", table.text());
}

void add_file(CLI::App& command, AccessOptions& options) {
  command.add_option("--file", options.file,
                     "The list itself (of limberd --curve-allow), where no server runs; one that "
                     "runs reads it again on SIGHUP");
}

}  // namespace

void add_access_commands(CLI::App& app, Context& context) {
  std::vector<std::string> roles;
  for (const auto& [name, unused] : kRoles) roles.push_back(name);
  auto options = std::make_shared<AccessOptions>();
  auto* command =
      subcommand(app, "allow", "Let a client's key in, or give it another role, from now on",
                 "limber allow ana.key.pub --role edit --name ana");
  command->add_option("key", options->key, "Public key (40 characters), or the file that holds it")
      ->required();
  command->add_option("--role", options->role, "view, edit or administer")
      ->required()
      ->check(CLI::IsMember(roles));
  command->add_option("--name", options->name, "Whose it is, by which it can be revoked");
  add_file(*command, *options);
  command->callback([&context, options] { allow(context, *options); });

  command = subcommand(app, "revoke",
                       "Take a key off the list; whoever has it is cut off at once, streams too",
                       "limber revoke ana");
  command->add_option("key", options->key, "Public key, the file that holds it, or its name")
      ->required();
  add_file(*command, *options);
  command->callback([&context, options] { revoke(context, *options); });

  command =
      subcommand(app, "allowed", "The keys that are allowed, and their roles", "limber allowed");
  add_file(*command, *options);
  command->callback([&context, options] { list(context, *options); });
}

}  // namespace limber::cli
