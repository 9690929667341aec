#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/frames.h"
#include "clients/cpp/linkage_shapes.h"

namespace limber::client {

using Vector = std::array<double, 3>;  // x y z

/// What loads a joint; nothing by default. The moment and the force keep their directions.
struct JointLoad {
  Vector force{};     // [N]
  Vector moment{};    // [N m]
  double torque = 0;  // opens the joint [N m]
};

/// A session of a rod linkage: edits, and what comes of them. Joints and segments count from 0,
/// angles are in degrees, positions in the scene's length unit. Edits return as soon as they are
/// accepted; wait() for the equilibrium. Every call may throw ClientError as Client::call. Several
/// may name the same session; must not outlive its client.
class LinkageSession {
 public:
  static constexpr double kStiffness = 1000;  // of springs to targets [N/m]
  static constexpr Milliseconds kPatience{600000};

  /// A session that is there already, of any client; nothing is sent.
  LinkageSession(Client& client, std::string session);
  /// Opens a scene with a linkage and waits until it is in equilibrium.
  /// @param session  its name; empty: chosen by the server
  /// @throws ClientError also with what the build failed with; the session is closed then, as it is
  /// where the time is over
  static LinkageSession open(Client& client, const v1::Scene& scene,
                             const std::string& session = "", Milliseconds timeout = kPatience);

  [[nodiscard]] const std::string& id() const { return session_; }
  [[nodiscard]] std::uint64_t revision() const { return revision_; }  // newest made or seen here
  v1::SessionStatus status();
  /// Pins, angles, targets and loads of every client, as of now.
  [[nodiscard]] v1::LinkageConditions conditions();

  /// All or nothing, in order, as one revision.
  v1::EditResponse edit(const std::vector<v1::Edit>& edits);
  /// The mean opening angle of all joints: the linkage goes there step by step. Nothing: it is
  /// free.
  v1::EditResponse deploy(std::optional<double> angle);
  /// An angle that one joint is to have from now on. Nothing: it is free.
  v1::EditResponse set_angle(unsigned joint, std::optional<double> angle);
  /// Holds a joint: its motion, its angle, or both. @param position  where to bring it
  v1::EditResponse pin(unsigned joint, v1::Held held = v1::HELD_MOTION_AND_ANGLE,
                       const std::optional<Vector>& position = {});
  v1::EditResponse release(unsigned joint);
  /// A spring from a joint, or from a point at a share of a segment's length, to a position.
  /// @returns the target's id
  std::uint64_t attach(unsigned joint, const Vector& position, double stiffness = kStiffness);
  std::uint64_t attach_segment(unsigned segment, double share, const Vector& position,
                               double stiffness = kStiffness);
  v1::EditResponse move_target(std::uint64_t target, const Vector& position);
  v1::EditResponse remove_target(std::uint64_t target);
  /// Replaces what loads a joint.
  v1::EditResponse load(unsigned joint, const JointLoad& load);
  v1::EditResponse gravity(const Vector& acceleration);  // [m/s^2]
  v1::EditResponse undo();
  v1::EditResponse redo();

  /// The final result of the newest revision made or seen here: `linkage()` of it has energies,
  /// mean angle, and the path of equilibria that led there. @throws ClientError TIMEOUT
  v1::ResultInfo wait(Milliseconds timeout = Milliseconds{60000});
  /// What stays the same for all shapes; fetched once.
  const LinkageGeometry& geometry();
  /// The equilibria on the way of the newest result, the shape itself last.
  [[nodiscard]] std::vector<LinkageShape> shapes();
  [[nodiscard]] LinkageShape shape();
  /// The same as nodes of the swept surface, whose triangles are GetGeometryResponse.surface.
  [[nodiscard]] Positions positions();

  /// Stops a running build or solve.
  void cancel();
  /// Ends the session for every client.
  void close();

 private:
  [[nodiscard]] v1::Frames frames(v1::Encoding encoding);
  std::uint64_t add(const v1::Edit& edit);

  Client* client_;
  std::string session_;
  std::uint64_t revision_ = 0;
  std::optional<LinkageGeometry> geometry_;
};

/// Where on the way to a result the branch of equilibria changed.
[[nodiscard]] std::vector<v1::LinkageStep> events(const v1::ResultInfo& result);

}  // namespace limber::client
