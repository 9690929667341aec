#pragma once

#include <google/protobuf/descriptor.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "server/wire/errors.h"

namespace limber::server {

/// What the envelope of a request says before anything of it is parsed.
struct RequestPeek {
  std::uint64_t id = 0;  // 0 where none could be read
  std::uint32_t version = 0;
  int body = 0;                  // field number of the body; 0: none
  std::string instance, client;  // as given
  std::string fault;             // why the bytes are no protobuf message; empty: they may be one
};

/// Reads only the first few outermost fields, in a time that does not depend on their length; never
/// throws, for any bytes.
[[nodiscard]] RequestPeek peek_request(std::string_view bytes);

/// The session that the body of a request names, without a uid behind it ("NAME@UID"). Empty where
/// it names none, or only behind more fields than a request may have; never throws.
/// @param body  as peeked
[[nodiscard]] std::string peek_session(std::string_view bytes, int body);

struct WireLimits {
  /// Submessages in one message, all levels: two bytes on the wire become a hundred in memory.
  std::uint64_t submessages = 1'000'000;
};

/// Walks serialised bytes beside their descriptor, before any memory is spent on them.
/// @throws Refusal MALFORMED where the bytes are no message; INVALID_ARGUMENT with the path of the
/// field where it is
///   unknown, has the wrong wire type, is given twice (a oneof too), holds an unknown enum value,
///   NaN or infinity; LIMIT_EXCEEDED for too many submessages.
void check_wire(std::string_view bytes, const google::protobuf::Descriptor& type,
                const WireLimits& limits = {});

}  // namespace limber::server
