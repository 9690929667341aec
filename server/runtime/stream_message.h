#pragma once

#include "limber/v1/stream.pb.h"
#include "server/runtime/run.h"

namespace limber::server {

/// A message of the stream before it has its payload and sequence number.
[[nodiscard]] inline proto::StreamMessage stream_message(const Run& run, const std::string& session,
                                                         std::uint64_t uid) {
  proto::StreamMessage message;
  message.set_version(1);
  message.set_session(session);
  message.set_instance(run.instance);
  message.set_session_uid(uid);
  return message;
}

}  // namespace limber::server
