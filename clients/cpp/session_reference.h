#pragma once

#include <cstdint>
#include <string>

#include "clients/cpp/client.h"

namespace limber::client {

/// NAME@UID, by which requests reach that very session; the name alone where the uid is 0.
[[nodiscard]] std::string session_reference(const std::string& name, std::uint64_t uid);
/// The name in NAME or NAME@UID.
[[nodiscard]] std::string session_name(const std::string& reference);

/// Which session a handle is of: never another one that has its name later.
class SessionReference {
 public:
  /// @param session  NAME or NAME@UID; nothing is sent
  SessionReference(const Client& client, std::string session);

  [[nodiscard]] std::string name() const { return session_name(session_); }
  /// NAME@UID; of a name alone, the uid is asked for the first time.
  /// @throws ServerRestarted if limberd was restarted before that; ClientError as Client::call
  [[nodiscard]] const std::string& get(Client& client);

 private:
  std::string session_;
  std::string instance_;  // of limberd, that the name is of
};

}  // namespace limber::client
