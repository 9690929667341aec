#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>
#include <string_view>

namespace limber::json {

/// What is wrong with a JSON text: where in the message, and what.
struct Fault {
  std::string field;  // "constraints[3].frame"; empty: the text as a whole
  std::string message;
};

/// Reads the JSON form of a message. Stricter than protobuf's reader in two things. A key that is
/// given twice in an object is refused, where protobuf takes the last one (or joins the lists), in
/// whichever of the two spellings (`fixed_nodes`, `fixedNodes`). And so is a comma before a closing
/// bracket, which other readers of JSON, limber's Python client among them, do not take.
[[nodiscard]] std::optional<Fault> read_message(std::string_view text,
                                                google::protobuf::Message& message);

/// The same of a scene. A text that is a structure of beams alone, as `limber beams` reads it, is a
/// scene of that; what is wrong in it is below "beams.structure".
/// @param scene  a limber.v1.Scene
[[nodiscard]] std::optional<Fault> read_scene(std::string_view text,
                                              google::protobuf::Message& scene);

}  // namespace limber::json
