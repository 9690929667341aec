#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>

#include "engine/session/core/limit_error.h"

namespace limber::server {

/// The engine names places in its own values ("edits[2].node"). This function finds the same place
/// in the message, from its descriptors and its given members:
///   - a member of that name, or of that name and its unit ("angle": "angle_degrees");
///   - for a oneof, the member that is given ("target": "position");
///   - a member of the given one in a oneof, or of the message that an edit wraps ("section.width":
///     "section.rectangle.width", "edits[2].node": "edits[2].set_beam_load.load.node");
///   - an entry of a list that has a message of its own ("targets[1]": "targets.targets[1]");
///   - a member whose name is the end of the engine's ("segment_lengths[3]" of an edit:
///     "lengths[3]"). In a message that is a choice of several, like a source of lines or an edit,
///     a missing place becomes the chosen member as a whole ("lines.edges[3]" of a file:
///     "lines.file").
/// @returns nothing where the message has no member that the field begins with
[[nodiscard]] std::optional<std::string> find_field(const google::protobuf::Message& message,
                                                    const std::string& field);

/// The same, and places that the message lacks stay unchanged.
[[nodiscard]] std::string field_in(const google::protobuf::Message& message,
                                   const std::string& field);

/// Runs `call`. The only place where errors of the engine get another field.
/// @param rename  from the engine's field to that of the request
template <class Rename, class Call>
auto with_fields(const Rename& rename, const Call& call) {
  try {
    return call();
  } catch (const Error& error) {
    session::rethrow_at(error, rename(error.field()));
  }
}

/// Fields of the engine's errors become those of `message`.
/// @param prefix  put before them, "structure."; an error without a field stays without
template <class Call>
auto with_fields_of(const google::protobuf::Message& message, const std::string& prefix,
                    const Call& call) {
  return with_fields(
      [&](const std::string& field) {
        return field.empty() ? field : prefix + field_in(message, field);
      },
      call);
}

/// The error is at `field`, not at the field that the engine names: readers name files and lines in
/// their messages.
template <class Call>
auto read_at(const std::string& field, const Call& call) {
  return with_fields([&](const std::string&) { return field; }, call);
}

}  // namespace limber::server
