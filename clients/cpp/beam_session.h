#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/frames.h"

namespace limber::client {

/// Where a node is brought: x, y, z from where it is drawn [m] and a rotation vector from rest
/// [radian]. What is not given stays as it is.
struct BeamMove {
  std::optional<double> x, y, z;
  std::optional<std::array<double, 3>> rotation;
};

/// A session of a structure of beams: edits, and what comes of them. Nodes and elements count from
/// 0, SI units. Edits return as soon as they are accepted; wait() for the equilibrium, which is
/// followed from the one there was. Every call may throw ClientError as Client::call. Several may
/// name the same session; must not outlive its client.
class BeamSession {
 public:
  using Vector = std::array<double, 3>;
  static constexpr Milliseconds kPatience{600000};

  /// A session that is there already, of any client; nothing is sent.
  BeamSession(Client& client, std::string session);
  /// Opens a scene with a structure of beams and waits until it is in equilibrium.
  /// @throws ClientError as open_session
  static BeamSession open(Client& client, const v1::Scene& scene, const std::string& session = "",
                          Milliseconds timeout = kPatience);

  [[nodiscard]] const std::string& id() const { return session_; }
  [[nodiscard]] std::uint64_t revision() const { return revision_; }  // newest made or seen here
  v1::SessionStatus status();
  /// Supports, motions and loads of every client, as of now.
  [[nodiscard]] v1::BeamStructure structure();

  /// All or nothing, in order, as one revision.
  v1::EditResponse edit(const std::vector<v1::Edit>& edits);
  /// Brings a node somewhere, whether a support held it or not, and holds it there.
  v1::EditResponse move_support(unsigned node, const BeamMove& move);
  /// Replaces the node's support; nothing fixed: it is gone.
  v1::EditResponse support(const v1::BeamSupport& support);
  /// Holds a node where it is, once it is at rest.
  v1::EditResponse hold(unsigned node);
  /// Takes the node's support and motion away.
  v1::EditResponse release(unsigned node);
  /// Replaces what loads the node [N], [N m]; zeros take it away.
  v1::EditResponse load(unsigned node, const Vector& force, const Vector& moment = {});
  /// Replaces what is distributed over the element [N/m].
  v1::EditResponse element_load(unsigned element, const Vector& force);
  v1::EditResponse gravity(const Vector& acceleration);  // [m/s^2]
  v1::EditResponse undo();
  v1::EditResponse redo();

  /// The final result of the newest revision made or seen here: `beams()` of it says how the solve
  /// went and where it snapped. @throws ClientError TIMEOUT
  v1::ResultInfo wait(Milliseconds timeout = Milliseconds{60000});
  /// Nodes of the shapes on the way of the newest result, the shape itself last.
  [[nodiscard]] Positions positions();
  /// Reactions, forces, stresses of the newest equilibrium.
  [[nodiscard]] v1::BeamSolution solution();

  /// Stops a running solve.
  void cancel();
  /// Ends the session for every client.
  void close();

 private:
  Client* client_;
  std::string session_;
  std::uint64_t revision_ = 0;
};

}  // namespace limber::client
