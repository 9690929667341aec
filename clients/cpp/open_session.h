#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/session_reference.h"
#include "clients/cpp/waiting.h"

namespace limber::client {

using Vector = std::array<double, 3>;  // x y z

[[nodiscard]] v1::Vector3 message(const Vector& vector);

/// Goal and time limit of a wait.
struct WaitOptions {
  std::optional<std::uint64_t> revision;  // default: the newest made or seen here
  v1::WaitRequest::Until until = v1::WaitRequest::UNTIL_FINAL;
  Milliseconds timeout{60000};
  /// Called about twice a second with the status of the session until there is a result.
  WaitProgress progress;
};

/// Frames of the newest result that are requested, and their encoding.
struct FrameOptions {
  v1::Encoding encoding = v1::ENCODING_COORDINATES;
  unsigned first = 0;
  unsigned count = 0;       // 0: to the last
  bool final_only = false;  // of the newest final result
};

/// How far an export is: parts that are written, of how many.
using ExportProgress = std::function<void(unsigned done, unsigned count)>;

/// Common part of sessions of all kinds. Edits return as soon as they are accepted; wait() for the
/// result. Every call may throw ClientError as Client::call. Several may name the same session;
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
  /// The scene as it is now, with all clients' edits.
  [[nodiscard]] v1::Scene scene();
  /// Both of the same revision.
  [[nodiscard]] v1::GetSessionResponse status_and_scene();
  /// Choices for the session and their reasons, the error of its newest result, and advice to
  /// change it.
  [[nodiscard]] v1::ExplainResponse explain();

  /// From now on this client is in the session, as it is from its first edit on. Returns the other
  /// clients, and the authors of the newest revisions.
  v1::JoinSessionResponse join();
  /// Others no longer see it in the session, until it edits or joins again.
  v1::LeaveSessionResponse leave();

  /// All or nothing, in order, as one revision.
  /// @param expected_revision  refused unless this is the newest
  v1::EditResponse edit(const std::vector<v1::Edit>& edits,
                        std::optional<std::uint64_t> expected_revision = {});
  v1::EditResponse gravity(const Vector& acceleration);  // [m/s^2]
  /// kOwn: of the client's name, also where others have edited since; kAnyone: the newest edit.
  enum class Whose { kOwn, kAnyone };
  v1::EditResponse undo(Whose whose = Whose::kOwn);
  v1::EditResponse redo(Whose whose = Whose::kOwn);

  /// The final result of the newest revision made or seen here. @throws ClientError TIMEOUT;
  /// Unreachable within 8 s of when the server falls silent
  v1::ResultInfo wait(Milliseconds timeout = Milliseconds{60000});
  v1::ResultInfo wait(const WaitOptions& options);
  /// The final result with its motion_error (of a body) or discretisation_error (of beams), which
  /// is there a moment after the result itself. @throws ClientError TIMEOUT
  v1::ResultInfo wait_checked(Milliseconds timeout = Milliseconds{60000});

  /// Stops a running build or solve.
  v1::CancelResponse cancel();
  /// Ends the session for every client.
  /// @param timeout  default: that of large answers
  v1::CloseSessionResponse close(std::optional<Milliseconds> timeout = {});

  /// Those of a large motion come in parts, all of one result, and are put together; quantised
  /// ones come whole.
  [[nodiscard]] v1::Frames frames(const FrameOptions& options = {});
  /// Geometry with which decode() makes positions of coordinates.
  /// @param basis_hash  of frames, whose basis it is then; empty: that of the newest result
  [[nodiscard]] v1::GetGeometryResponse geometry_message(const std::string& basis_hash = {});
  /// Writes files of the newest result, all parts of the same one though edits may go on.
  /// @param stem  of their names; empty: chosen by the server
  /// @returns what was written, each file once
  /// @throws ClientError also MALFORMED, IO
  std::set<std::string> export_files(v1::ExportFormat format, const std::filesystem::path& folder,
                                     const std::string& stem = "",
                                     const ExportProgress& progress = {});

 protected:
  /// A request about this session.
  template <class Request>
  [[nodiscard]] Request request() {
    Request result;
    result.set_session(reference());
    return result;
  }
  [[nodiscard]] Client& client() { return *client_; }

 private:
  [[nodiscard]] v1::Frames frames_in_parts(v1::GetFramesRequest wanted);

  Client* client_;
  SessionReference session_;
  std::uint64_t revision_ = 0;
};

}  // namespace limber::client
