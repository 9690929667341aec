#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/frames.h"
#include "clients/cpp/linkages/shapes.h"
#include "clients/cpp/open_session.h"

namespace limber::client {

/// Load of a joint; nothing by default. The moment and the force keep their directions.
struct JointLoad {
  Vector force{};     // [N]
  Vector moment{};    // [N m]
  double torque = 0;  // opens the joint [N m]
};

/// A session of a rod linkage: edits, and their results. Joints and segments count from 0, angles
/// are in degrees, positions in the scene's length unit. `linkage()` of a result that wait() waits
/// for has energies, mean angle, and the path of equilibria that led there.
class LinkageSession : public OpenSession {
 public:
  static constexpr double kStiffness = 1000;  // of springs to targets [N/m]

  /// A session that is there already, of any client, as NAME or NAME@UID; nothing is sent.
  LinkageSession(Client& client, std::string session, Naming naming = Naming::kByUid);
  /// Opens a scene with a linkage and waits until it is in equilibrium.
  /// @param session  its name; empty: chosen by the server
  /// @throws ClientError also of the build's failure; the session is closed then, and also if the
  /// time is over
  static LinkageSession open(Client& client, const v1::Scene& scene,
                             const std::string& session = "", Milliseconds timeout = kPatience);

  /// Pins, angles, targets and loads of every client, as of now.
  [[nodiscard]] v1::LinkageConditions conditions();

  /// The mean opening angle of all joints: the linkage goes there step by step. Nothing: it is
  /// free.
  v1::EditResponse deploy(std::optional<double> angle);
  /// An angle that one joint is to have from now on. Nothing: it is free.
  v1::EditResponse set_angle(unsigned joint, std::optional<double> angle);
  /// Holds a joint: its motion, its angle, or both. @param position  where to bring it
  v1::EditResponse pin(unsigned joint, v1::Held held = v1::HELD_MOTION_AND_ANGLE,
                       const std::optional<Vector>& position = {});
  v1::EditResponse release(unsigned joint);
  /// Adds a spring to a target; its id is in target_ids.
  v1::EditResponse add_target(const v1::LinkageTarget& target);
  /// A spring from a joint, or from a point at a share of a segment's length, to a position.
  /// @returns the target's id
  std::uint64_t attach(unsigned joint, const Vector& position, double stiffness = kStiffness);
  std::uint64_t attach_segment(unsigned segment, double share, const Vector& position,
                               double stiffness = kStiffness);
  v1::EditResponse move_target(std::uint64_t target, const Vector& position);
  v1::EditResponse remove_target(std::uint64_t target);
  /// As one revision.
  v1::EditResponse remove_targets(const std::vector<std::uint64_t>& targets);
  /// Replaces the loads of a joint.
  v1::EditResponse load(unsigned joint, const JointLoad& load);

  /// Data common to all shapes; fetched once.
  const LinkageGeometry& geometry();
  /// The equilibria along the path of the newest result, the shape itself last.
  [[nodiscard]] std::vector<LinkageShape> shapes();
  [[nodiscard]] LinkageShape shape();
  /// The same as nodes of the swept surface, whose triangles are GetGeometryResponse.surface.
  [[nodiscard]] Positions positions();

 private:
  std::uint64_t attach(const v1::LinkageTarget& target);

  std::optional<LinkageGeometry> geometry_;
};

/// Places on the path to a result where the branch of equilibria changed.
[[nodiscard]] std::vector<v1::LinkageStep> events(const v1::ResultInfo& result);

}  // namespace limber::client
