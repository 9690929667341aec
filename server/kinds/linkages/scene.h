#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/scene/linkage.h"
#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// Resolves every source of lines but arrays: files, samples. `field` is the path of the source for
/// errors.
using LineLoader =
    std::function<rods::LineMesh(const proto::LineSource& source, const std::string& field)>;

/// The linkage of a scene that has one; omitted members get the defaults the .proto states. Numbers
/// are checked as far as the wire goes; the engine does the rest.
/// @param prefix  path of the message, "scene." or empty
/// @throws Refusal or Error with a path below `prefix`; also for fields that only bodies have
[[nodiscard]] scene::Linkage decode_linkage(const proto::Scene& message, const std::string& prefix,
                                            const LineLoader& load_lines);
/// As a scene, without its lines: the caller sets those where it knows a short source.
[[nodiscard]] proto::Scene encode_linkage(const scene::Linkage& linkage);

/// A field of the engine's linkage as one of the scene.
[[nodiscard]] std::string linkage_field_in(const proto::Scene& message, const std::string& field);

/// Conditions and erection alone. @throws Refusal or Error naming `field` and its members
[[nodiscard]] scene::LinkageConditions decode_linkage_conditions(const proto::RodLinkage& message,
                                                                 const std::string& field);
/// The message that decodes to the same conditions, to the last digit; its other fields are empty.
[[nodiscard]] proto::RodLinkage encode_linkage_conditions(
    const scene::LinkageConditions& conditions);

[[nodiscard]] std::shared_ptr<const scene::LinkageErection> decode_erection(
    const proto::LinkageErection& message, const std::string& field);
[[nodiscard]] proto::LinkageErection encode_erection(const scene::LinkageErection& erection);
[[nodiscard]] scene::JointPin decode_pin(const proto::JointPin& message, const std::string& field);
[[nodiscard]] scene::LinkageTarget decode_target(const proto::LinkageTarget& message,
                                                 const std::string& field);
[[nodiscard]] scene::JointLoad decode_load(const proto::JointLoad& message,
                                           const std::string& field);
/// In radian. @param joint  the joint of the angle, for the message; empty: a mean, or a bound
/// @throws Refusal OUT_OF_RANGE unless it is in (-180, 180)
[[nodiscard]] double decode_angle(double degrees, const std::string& field,
                                  std::optional<int> joint = {});
[[nodiscard]] double to_degrees(double radian);

}  // namespace limber::server
