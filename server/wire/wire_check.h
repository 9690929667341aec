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

/// Walks serialised bytes along their descriptor, before any memory is spent on them.
/// @throws Refusal MALFORMED if the bytes are no message. UNSUPPORTED for a request or an edit of
/// an unknown kind. LIMIT_EXCEEDED for too many submessages. INVALID_ARGUMENT with the path of a
/// field that is unknown (except in GetServerInfoRequest, where it is passed over), has the wrong
/// wire type or is given twice (a oneof too). The same for a field that holds an unknown enum
/// value, NaN, infinity or a text with a zero byte, or is a group.
void check_wire(std::string_view bytes, const google::protobuf::Descriptor& type,
                WireBudget& budget);
/// The same of a message that is alone.
void check_wire(std::string_view bytes, const google::protobuf::Descriptor& type);

}  // namespace limber::server
