// Files in the requests that carry them. The first byte chooses where the file is; then its NAME, a
// line end, the bytes. Behind lines "%%%" follow companions in the same form, of motions the
// further files. Up to the values that the request is answered from.
//   m mesh, f painted stiffness, s surface, k pose of a keyframe, b base motion of .vtu files,
//   p base motion of a .pc2, l lines of a linkage, e lines of a structure, j a job that is solved,
//   t surface that is filled, d surface of a design, c surface that a design is changed to,
//   a pose of a keyframe that an edit adds
#include <string>
#include <utility>
#include <vector>

#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;
namespace proto = limber::v1;
using Files = std::vector<std::pair<std::string, std::string>>;

void put(const Files& files, proto::MeshFile& file) {
  file.set_name(files.front().first);
  file.set_content(files.front().second);
  for (std::size_t i = 1; i < files.size(); ++i)
    (*file.mutable_companions())[files[i].first] = files[i].second;
}

void set_points(proto::Array& array, std::initializer_list<double> numbers) {
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(numbers.size() / 3);
  array.add_shape(3);
  array.set_data(std::data(numbers), numbers.size() * sizeof(double));
}

/// A scene of one tet and three frames, into which the file is put.
proto::Scene& small_body(proto::Request& request) {
  proto::Scene& scene = *request.mutable_open_session()->mutable_scene();
  scene.set_frames(3);
  auto& mesh = *scene.mutable_mesh()->mutable_arrays();
  set_points(*mesh.mutable_nodes(), {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  auto& tets = *mesh.mutable_tets();
  tets.set_type(proto::DATA_TYPE_INT32);
  tets.add_shape(1);
  tets.add_shape(4);
  constexpr std::int32_t kTet[] = {0, 1, 2, 3};
  tets.set_data(kTet, sizeof kTet);
  return scene;
}

proto::BeamStructure& put_section(proto::BeamStructure& structure) {
  auto& section = *structure.add_sections();
  section.mutable_rectangle()->set_width(0.02);
  section.mutable_rectangle()->set_height(0.01);
  section.set_young(1e9);
  section.set_poisson(0.3);
  return structure;
}

proto::Request body_request(char place, const Files& files) {
  proto::Request request;
  proto::Scene& scene = small_body(request);
  if (place == 'm') put(files, *scene.mutable_mesh()->mutable_file());
  if (place == 'f') put(files, *scene.mutable_painted_stiffness()->mutable_file());
  if (place == 's') put(files, *scene.mutable_surface()->mutable_file());
  if (place == 'k') put(files, *scene.add_keyframes()->mutable_file());
  if (place == 'p') scene.mutable_base_motion()->set_pc2(files.front().second);
  for (std::size_t i = 0; place == 'b' && i < files.size(); ++i)
    put({files[i]}, *scene.mutable_base_motion()->mutable_vtu_series()->add_files());
  return request;
}

proto::Request request_of(char place, const Files& files) {
  proto::Request request;
  switch (place) {
    case 'l': {
      auto& linkage = *request.mutable_open_session()->mutable_scene()->mutable_linkage();
      linkage.mutable_section()->mutable_rectangle()->set_width(0.02);
      linkage.mutable_section()->mutable_rectangle()->set_height(0.01);
      put(files, *linkage.mutable_lines()->mutable_file());
      break;
    }
    case 'e': {
      auto& beams = *request.mutable_open_session()->mutable_scene()->mutable_beams();
      put_section(*beams.mutable_structure());
      put(files, *beams.mutable_lines()->mutable_file());
      break;
    }
    case 'j':
      put(files, *request.mutable_solve_beams()->mutable_job());
      break;
    case 't':
      put(files, *request.mutable_tetrahedralize()->mutable_surface());
      break;
    case 'd':
      put(files,
          *request.mutable_start_design()->mutable_goal()->mutable_surface()->mutable_file());
      break;
    case 'c':
      put(files, *request.mutable_change_design()->mutable_surface()->mutable_file());
      break;
    case 'a':
      put(files, *request.mutable_edit()
                      ->add_edits()
                      ->mutable_add_keyframe()
                      ->mutable_keyframe()
                      ->mutable_file());
      break;
    default:
      return body_request(place, files);
  }
  return request;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest = fuzz::text_of(data, size);
  if (rest.empty()) return 0;
  const char place = rest.front();
  rest.remove_prefix(1);
  Files files;
  while (files.empty() || (!rest.empty() && files.size() < 4)) {
    std::string_view file = fuzz::take_until(rest, "\n%%%\n");
    std::string name = fuzz::take_name(file);
    files.emplace_back(std::move(name), std::string(file));
  }
  fuzz::decode_request(request_of(place, files));
  return 0;
}
