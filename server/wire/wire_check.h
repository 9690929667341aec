#pragma once

#include <google/protobuf/descriptor.h>

#include <cstdint>
#include <string_view>

#include "server/wire/errors.h"

namespace limber::server {

/// Submessages, of all levels: two bytes on the wire become a hundred in memory. One for a request,
/// and one for all the extensions in it.
struct WireBudget {
  std::uint64_t submessages = 1'000'000;  // that there may be
  std::uint64_t spent = 0;                // by what was checked
};

/// Walks serialised bytes beside their descriptor, before any memory is spent on them.
/// @throws Refusal MALFORMED where the bytes are no message; UNSUPPORTED for a request or an edit
/// of
///   a kind that is unknown; INVALID_ARGUMENT with the path of the field where it is unknown (but
///   in GetServerInfoRequest, where it is passed over), has the wrong wire type, is given twice (a
///   oneof too), holds an unknown enum value, NaN, infinity or a text with a zero byte, or is a
///   group; LIMIT_EXCEEDED for too many submessages.
void check_wire(std::string_view bytes, const google::protobuf::Descriptor& type,
                WireBudget& budget);
/// The same of a message that is alone.
void check_wire(std::string_view bytes, const google::protobuf::Descriptor& type);

}  // namespace limber::server
