// Jobs of the public relaxation code, as they are uploaded: SimulationJob.json; behind a line "%%%"
// the mesh that it names, NAME, a line end, the bytes; behind another one DRMSettings.json. Up to
// the structure that is solved.
#include <string>

#include "engine/scene/formats/beam_job.h"
#include "limber/v1/scene.pb.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace limber;
  std::string_view rest = fuzz::text_of(data, size);
  const std::string_view job = fuzz::take_until(rest, "\n%%%\n");
  std::string_view mesh = fuzz::take_until(rest, "\n%%%\n");
  fuzz::reads([&] { (void)scene::read_beam_job(job, rest); });

  v1::Scene scene;
  v1::MeshFile& file = *scene.mutable_beams()->mutable_job();
  file.set_name("SimulationJob.json");
  file.set_content(std::string(job));
  const std::string name = fuzz::take_name(mesh);
  if (!name.empty()) (*file.mutable_companions())[name] = std::string(mesh);
  if (!rest.empty()) (*file.mutable_companions())["DRMSettings.json"] = std::string(rest);
  fuzz::decode_scene(scene);
  return 0;
}
