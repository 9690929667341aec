// Scene files: JSON, as the server's tools and the clients read it, up to the values of a session.
#include "proto/json_text.h"
#include "server/wire/errors.h"
#include "server/wire/scene_json.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace limber;
  const std::string_view text = fuzz::text_of(data, size);
  v1::Scene scene;
  if (const auto fault = json::read_scene(text, scene); fault && fault->message.empty())
    fuzz::finding("a fault without a message");  // as clients read it
  if (!fuzz::answers([&] { scene = server::scene_from_json(text); })) {
    v1::BeamStructure structure;  // which files may have alone
    if (const auto fault = json::read_message(text, structure); fault && fault->message.empty())
      fuzz::finding("a fault without a message");
    return 0;
  }
  // What is written is read again.
  if (!fuzz::answers([&] { (void)server::scene_from_json(server::scene_to_json(scene)); }))
    fuzz::finding("a scene that was written as JSON cannot be read");
  fuzz::decode_scene(scene);
  return 0;
}
