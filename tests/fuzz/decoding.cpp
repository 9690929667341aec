#include "tests/fuzz/decoding.h"

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <new>
#include <string>
#include <vector>

#include "engine/scene/formats/surface_formats.h"
#include "server/kinds/beams/edit.h"
#include "server/kinds/beams/scene.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/beams/structure.h"
#include "server/kinds/bodies/edit.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/scene.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/kinds/bodies/scenes.h"
#include "server/kinds/linkages/design.h"
#include "server/kinds/linkages/edit.h"
#include "server/kinds/linkages/scene.h"
#include "server/kinds/linkages/scenes.h"
#include "server/runtime/options.h"
#include "server/wire/errors.h"
#include "tests/fuzz/input.h"

namespace limber::fuzz {
namespace {

/// Damaged strings are not worth a line each.
[[maybe_unused]] google::protobuf::LogHandler* const kQuiet =
    google::protobuf::SetLogHandler(nullptr);

/// Clients read what is sent to them, and a file does not decide how long that is.
void demand_readable(const google::protobuf::Message& message, google::protobuf::Message&& again) {
  const std::string bytes = message.SerializeAsString();
  if (!again.ParseFromString(bytes)) finding("a message that no client can read");
  if (bytes.size() > 10'000) finding("a message that is as long as a file likes");
}

std::filesystem::path no_file(const std::string&, const std::string& field) {
  throw Error(ErrorCode::kNotFound, field, "no file of this machine may be read");
}

const server::ServiceLimits kLimits{
    .mesh_tets = 10'000, .frames = 10'000, .session_bytes = 1 << 30};
constexpr scene::MeshReadLimits kMeshLimits{.array_bytes = 16 << 20};

/// Samples are limber's own and take long to make.
server::SceneReaders readers() {
  server::SceneReaders all = server::scene_readers(no_file, kMeshLimits);
  all.mesh = [load = all.mesh](const proto::MeshSource& source, const std::string& field) {
    if (source.has_sample()) throw Error(ErrorCode::kNotFound, field + ".sample", "no samples");
    return load(source, field);
  };
  return all;
}

bool has_error(const std::vector<proto::Issue>& issues) {
  return std::any_of(issues.begin(), issues.end(), [](const proto::Issue& issue) {
    return issue.severity() == proto::Issue::SEVERITY_ERROR;
  });
}

void agree(bool is_opened, const std::vector<proto::Issue>& issues) {
  for (const auto& issue : issues) demand_readable(issue, proto::Issue());
  if (is_opened == has_error(issues))
    finding(is_opened ? "a scene that can be opened is said to have errors"
                      : "a scene that cannot be opened is said to have none");
}

void decode_body(const proto::Scene& message) {
  const server::SceneLimits limits = server::scene_limits(kLimits);
  const bool is_opened = answers([&] {
    const auto decoded = server::decode_scene(message, "scene.", limits, readers());
    (void)server::remarks(message, decoded, "scene.");
    server::demand_memory(decoded.scene, limits);
  });
  answers([&] { agree(is_opened, server::scene_issues(message, "scene.", limits, readers())); });
}

void decode_linkage(const proto::Scene& message) {
  if (message.linkage().lines().has_sample()) return;
  answers([&] {
    const auto linkage = server::decode_linkage(message, "scene.", server::line_loader(no_file));
    (void)server::encode_linkage(linkage);
  });
}

void decode_beams(const proto::Scene& message) {
  const auto load = server::edge_loader(no_file);
  const bool is_opened = answers([&] {
    const auto beams = server::decode_beam_scene(message, "scene.", load);
    (void)server::demand_beam_memory(beams, kLimits.session_bytes);
    // What comes back is the same structure: it is read again.
    (void)server::decode_beam_scene(server::encode_beam_scene(beams), "scene.", load);
  });
  answers([&] {
    agree(is_opened, server::beam_issues(message, "scene.", load, kLimits.session_bytes));
  });
}

bodies::NodePositions tetrahedron() {
  bodies::NodePositions nodes(3, 4);
  nodes << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  return nodes;
}

}  // namespace

bool answers(const std::function<void()>& read) {
  try {
    read();
    return true;
  } catch (const std::bad_alloc& fault) {
    finding(fault.what());
  } catch (const std::exception& fault) {
    const proto::Error error = server::error_to_proto(fault);
    if (error.code() == proto::ERROR_CODE_INTERNAL) finding(fault.what());
    if (error.message().empty()) finding("a refusal without a message");
    demand_readable(error, proto::Error());
    return false;
  }
}

void decode_scene(const proto::Scene& scene) {
  if (scene.has_linkage()) return decode_linkage(scene);
  if (scene.has_beams()) return decode_beams(scene);
  decode_body(scene);
}

void decode_edits(const proto::EditRequest& request) {
  static const scene::Scene scene = [] {
    scene::Scene made;
    made.mesh.nodes = tetrahedron();
    made.fixed_nodes = {0, 1};
    made.frame_count = 3;
    return made;
  }();
  static const std::vector<beams::BeamNode> nodes(4);
  answers([&] { (void)server::decode_edits(request, scene, readers().mesh); });
  answers([&] { (void)server::decode_linkage_edits(request); });
  answers([&] { (void)server::decode_beam_edits(request, nodes); });
}

namespace {

void decode_design(const proto::Request& request) {
  const server::SurfaceLoader load = [](const std::string& path, const std::string& field) {
    return scene::read_surface_file(no_file(path, field));
  };
  answers([&] {
    if (request.has_start_design())
      (void)server::decode_design(request.start_design(), load);
    else
      (void)server::decode_design_change(request.change_design(), load);
  });
}

void decode_solve(const proto::SolveBeamsRequest& request) {
  if (request.has_structure()) {
    proto::Scene scene;
    *scene.mutable_beams()->mutable_structure() = request.structure();
    decode_beams(scene);
  }
  answers([&] { (void)server::decode_beam_job(request.job(), "job"); });
}

}  // namespace

void decode_request(const proto::Request& request) {
  switch (request.body_case()) {
    case proto::Request::kOpenSession:
      return decode_scene(request.open_session().scene());
    case proto::Request::kValidateScene:
      return decode_scene(request.validate_scene().scene());
    case proto::Request::kSimulate:
      return decode_scene(request.simulate().scene());
    case proto::Request::kRecover:
      return decode_scene(request.recover().scene());
    case proto::Request::kEdit:
      return decode_edits(request.edit());
    case proto::Request::kSolveBeams:
      return decode_solve(request.solve_beams());
    case proto::Request::kStartDesign:
    case proto::Request::kChangeDesign:
      return decode_design(request);
    case proto::Request::kTetrahedralize: {
      const proto::MeshFile& file = request.tetrahedralize().surface();
      answers(
          [&] { (void)scene::closed_outward(scene::read_surface(file.name(), file.content())); });
      return;
    }
    default:
      return;
  }
}

}  // namespace limber::fuzz
