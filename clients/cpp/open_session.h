#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/session_reference.h"

namespace limber::client {

using Vector = std::array<double, 3>;  // x y z

[[nodiscard]] v1::Vector3 message(const Vector& vector);

/// What sessions of linkages and beams have in common. Edits return as soon as they are accepted;
/// wait() for the equilibrium. Every call may throw ClientError as Client::call. Several may name
/// the same session; must not outlive its client.
class OpenSession {
 public:
  static constexpr Milliseconds kPatience{600000};

  [[nodiscard]] std::string id() const { return session_.name(); }
  /// NAME@UID, by which requests reach this very session and never another one of its name.
  [[nodiscard]] const std::string& reference() { return session_.get(*client_); }
  [[nodiscard]] std::uint64_t revision() const { return revision_; }  // newest made or seen here
  v1::SessionStatus status();

  /// All or nothing, in order, as one revision.
  v1::EditResponse edit(const std::vector<v1::Edit>& edits);
  v1::EditResponse gravity(const Vector& acceleration);  // [m/s^2]
  v1::EditResponse undo();
  v1::EditResponse redo();

  /// The final result of the newest revision made or seen here. @throws ClientError TIMEOUT
  v1::ResultInfo wait(Milliseconds timeout = Milliseconds{60000});

  /// Stops a running build or solve.
  void cancel();
  /// Ends the session for every client.
  void close();

 protected:
  /// A session that is there already, of any client, as NAME or NAME@UID; nothing is sent. Of a
  /// name, the uid is asked for with the first request.
  OpenSession(Client& client, std::string session);
  ~OpenSession() = default;
  OpenSession(const OpenSession&) = default;
  OpenSession(OpenSession&&) = default;
  OpenSession& operator=(const OpenSession&) = default;
  OpenSession& operator=(OpenSession&&) = default;

  /// The scene as it is now, with all clients' edits.
  [[nodiscard]] v1::Scene scene();
  /// Of the newest result.
  [[nodiscard]] v1::Frames frames(v1::Encoding encoding);
  /// A request about this session.
  template <class Request>
  [[nodiscard]] Request request() {
    Request result;
    result.set_session(reference());
    return result;
  }
  [[nodiscard]] Client& client() { return *client_; }

 private:
  Client* client_;
  SessionReference session_;
  std::uint64_t revision_ = 0;
};

}  // namespace limber::client
