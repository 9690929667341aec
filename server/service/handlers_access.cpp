// Access control: reads and changes the server's list of keys.

#include <fmt/format.h>

#include <algorithm>

#include "server/log/log.h"
#include "server/service/roles.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

void encode(const AllowList::Entry& entry, proto::AllowedKey& message) {
  message.set_key(entry.key);
  message.set_role(to_proto(entry.allowed.role));
  message.set_name(entry.allowed.name);
}

/// @throws Refusal FAILED_PRECONDITION where there is no list
const std::filesystem::path& list_of(const TransportOptions& options) {
  if (!options.curve) {
    throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "",
                  "this limberd was started without CURVE keys (--curve-secret-file, "
                  "--curve-allow): everybody who reaches it administers");
  }
  if (options.curve->allow_file.empty()) {
    throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "",
                  "this server has its keys from no file: they cannot be changed");
  }
  return options.curve->allow_file;
}

bool is_administered(const AllowList& list) {
  const auto entries = list.entries();
  return std::any_of(entries.begin(), entries.end(), [](const AllowList::Entry& entry) {
    return entry.allowed.role == Role::kAdminister;
  });
}

}  // namespace

proto::ListAllowedResponse Service::list_allowed(const proto::ListAllowedRequest&) const {
  proto::ListAllowedResponse response;
  for (const auto& entry : read_allow_list(list_of(hub_.options.transport)).entries())
    encode(entry, *response.add_keys());
  return response;
}

/// The list that is read back is what counts from now on: lines that somebody has written into the
/// file meanwhile, too. Two changes that run at once hand it over in their order.
void Service::change_list(const Ticket& ticket, const std::function<void(AllowList&)>& change) {
  const std::lock_guard order(list_order_);
  const auto changed = change_allow_list(list_of(hub_.options.transport), [&](AllowList& list) {
    // Meanwhile another client may have taken the role from this one.
    const auto own = list.find(ticket.key());
    if (!ticket.key().empty()) {
      demand_role(own ? own->allowed.role : Role::kView, Role::kAdminister, "",
                  "to change the list of keys");
    }
    const bool was_administered = is_administered(list);
    change(list);
    if (was_administered && !is_administered(list)) {
      throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "key",
                    "then no key would administer: let another one do so first");
    }
  });
  hub_.transport.allow(changed.keys());
}

std::string Service::with_names_of_keys(std::string text) const {
  const auto& curve = hub_.options.transport.curve;
  if (!curve) return text;
  AllowedKeys keys = curve->allowed;
  if (!curve->allow_file.empty()) {
    try {
      keys = read_allowed_keys(curve->allow_file);
    } catch (const Error& fault) {  // as somebody is writing it
      log::debug("{}", fault.what());
    }
  }
  for (const auto& [key, allowed] : keys) {
    const auto at = text.find(key);
    if (at != std::string::npos && !allowed.name.empty())
      text.replace(at, key.size(), allowed.name);
  }
  return text;
}

void Service::allow(AllowedKeys keys) {
  const std::lock_guard order(list_order_);
  const auto& curve = hub_.options.transport.curve;
  if (curve && !curve->allow_file.empty()) keys = read_allowed_keys(curve->allow_file);
  hub_.transport.allow(std::move(keys));
}

void Service::allow_key(const proto::AllowRequest& request, const SharedTicket& ticket) {
  const auto role = from_proto(request.key().role());
  if (!role) throw invalid("key.role", "is view, edit or administer");
  AllowList::Entry entry{request.key().key(), {*role, request.key().name()}};
  if (entry.key == ticket->key() && *role < ticket->role()) {
    throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "key.key",
                  "nobody may lower the role of their own key: another one that administers may");
  }
  proto::Reply reply;
  change_list(*ticket, [&](AllowList& list) {
    if (const auto before = list.find(entry.key)) {
      encode(*before, *reply.mutable_allow()->mutable_before());
      if (entry.allowed.name.empty()) entry.allowed.name = before->allowed.name;
    }
    list.put(entry);
  });
  log::info("{} ({}) is allowed to {}", entry.key, entry.allowed.name, name_of(*role));
  encode(entry, *reply.mutable_allow()->mutable_key());
  ticket->answer(std::move(reply));
}

void Service::revoke_key(const proto::RevokeRequest& request, const SharedTicket& ticket) {
  proto::Reply reply;
  std::string key;
  change_list(*ticket, [&](AllowList& list) {
    const auto entry = list.find(request.key());
    if (!entry) {
      throw Refusal(proto::ERROR_CODE_NOT_FOUND, "key",
                    fmt::format("'{}' is neither a key nor a name in the list", request.key()));
    }
    if (entry->key == ticket->key()) {
      throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "key",
                    "nobody may revoke their own key: another one that administers may");
    }
    key = entry->key;
    encode(*entry, *reply.mutable_revoke()->mutable_key());
    list.remove(entry->key);
  });
  log::info("{} ({}) is revoked", key, reply.revoke().key().name());
  ticket->answer(std::move(reply));
}

}  // namespace limber::server
