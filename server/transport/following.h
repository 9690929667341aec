#pragma once

#include <string>

#include "limber/v1/follow.pb.h"
#include "server/transport/followers.h"

namespace limber::server {

/// A request to follow a stream, without its client.
/// @param instance  this run of the server: positions read from another run are ignored
/// @throws Refusal INVALID_ARGUMENT naming stream or topics[i].prefix, LIMIT_EXCEEDED naming topics
[[nodiscard]] Following following_of(const v1::FollowRequest& request, const std::string& instance);

}  // namespace limber::server
