#pragma once

#include <google/protobuf/message.h>

#include <functional>

#include "limber/v1/scene.pb.h"
#include "limber/v1/service.pb.h"

/// What limberd does with a scene and with edits before a session is made of them, without a
/// server.
namespace limber::fuzz {

namespace proto = limber::v1;

/// As reads(), of what the server reads: the refusal must be a reply that clients can read, and
/// short.
bool answers(const std::function<void()>& read);

/// Reads a scene of whatever kind it is; of bodies and beams, all that is wrong with it, too: that
/// a scene can be opened although it is said to have errors, or the other way round, is a finding.
void decode_scene(const proto::Scene& scene);
/// Reads edits as those of sessions of every kind.
void decode_edits(const proto::EditRequest& request);
/// Reads what a request brings: scenes, edits, jobs, surfaces.
void decode_request(const proto::Request& request);

}  // namespace limber::fuzz
