#pragma once

#include <cstdint>
#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

/// NAME@UID, by which requests reach that very session; the name alone where the uid is 0.
[[nodiscard]] std::string session_reference(const std::string& name, std::uint64_t uid);
/// The name in NAME or NAME@UID.
[[nodiscard]] std::string session_name(const std::string& reference);

/// How requests name a session that is given as NAME, without its uid.
enum class Naming {
  kByUid,    // as NAME@UID, which is requested first: never another session that has its name later
  kAsGiven,  // as NAME: one request less, for clients that make only one
};

/// Which session a handle is of.
class SessionReference {
 public:
  /// @param session  NAME or NAME@UID; nothing is sent
  SessionReference(const Client& client, std::string session, Naming naming = Naming::kByUid);

  [[nodiscard]] std::string name() const { return session_name(session_); }
  /// The reference for requests. If a name alone is to become NAME@UID, the uid is requested the
  /// first time.
  /// @throws ServerRestarted if limberd was restarted before that; ClientError as Client::call
  [[nodiscard]] const std::string& get(Client& client);

 private:
  std::string session_;
  Naming naming_;
  std::string instance_;  // of limberd, that the name is of
};

}  // namespace limber::client
