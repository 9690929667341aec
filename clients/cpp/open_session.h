#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/opening.h"
#include "clients/cpp/session_reference.h"

namespace limber::client {

using Vector = std::array<double, 3>;  // x y z

[[nodiscard]] v1::Vector3 message(const Vector& vector);

/// What a wait is for, and how long.
struct WaitOptions {
  std::optional<std::uint64_t> revision;  // default: the newest made or seen here
  v1::WaitRequest::Until until = v1::WaitRequest::UNTIL_FINAL;
  Milliseconds timeout{60000};
  /// Told about twice a second how the session is while there is no result yet.
  WaitProgress progress;
};

/// What sessions of all kinds have in common. Edits return as soon as they are accepted; wait() for
/// the result. Every call may throw ClientError as Client::call. Several may name the same session;
/// must not outlive its client.
class OpenSession {
 public:
  static constexpr Milliseconds kPatience{600000};

  /// A session that is there already, of any client and kind, as NAME or NAME@UID; nothing is sent.
  OpenSession(Client& client, std::string session, Naming naming = Naming::kByUid);

  [[nodiscard]] std::string id() const { return session_.name(); }
  /// NAME@UID, by which requests reach this very session and never another one of its name; as
  /// given where that is wanted.
  [[nodiscard]] const std::string& reference() { return session_.get(*client_); }
  [[nodiscard]] std::uint64_t revision() const { return revision_; }  // newest made or seen here
  v1::SessionStatus status();

  /// All or nothing, in order, as one revision.
  /// @param expected_revision  refused unless this is the newest
  v1::EditResponse edit(const std::vector<v1::Edit>& edits,
                        std::optional<std::uint64_t> expected_revision = {});
  v1::EditResponse gravity(const Vector& acceleration);  // [m/s^2]
  v1::EditResponse undo();
  v1::EditResponse redo();

  /// The final result of the newest revision made or seen here. @throws ClientError TIMEOUT;
  /// Unreachable within 8 s of when the server falls silent
  v1::ResultInfo wait(Milliseconds timeout = Milliseconds{60000});
  v1::ResultInfo wait(const WaitOptions& options);

  /// Stops a running build or solve.
  v1::CancelResponse cancel();
  /// Ends the session for every client.
  v1::CloseSessionResponse close();

 protected:
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
