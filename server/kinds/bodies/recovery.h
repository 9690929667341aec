#pragma once

#include "engine/session/bodies/recovery.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The settings besides the scene; absent fields get the defaults that the .proto states.
/// @throws Refusal OUT_OF_RANGE naming a number of frames that is no int
[[nodiscard]] session::RecoveryRequest decode_recovery(const proto::RecoverRequest& message);

[[nodiscard]] proto::RecoveryReport encode_report(const session::MaterialRecovery& recovery);

}  // namespace limber::server
