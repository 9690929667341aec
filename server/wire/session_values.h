#pragma once

#include "engine/session/core/result_header.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

[[nodiscard]] proto::SessionState encode_state(session::State state);
/// The use of resources in the status of a session.
[[nodiscard]] proto::SessionUse use_of(const proto::SessionStatus& status);
[[nodiscard]] proto::Progress encode_progress(const session::Progress& progress);
/// Members common to results of every kind: revision, number, whether it is final, whether the
/// solve failed, its age.
[[nodiscard]] proto::ResultInfo encode_header(const session::ResultHeader& header);

}  // namespace limber::server
