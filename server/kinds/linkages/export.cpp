#include "server/kinds/linkages/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/polylines.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/session/linkages/files.h"
#include "server/kinds/linkages/result.h"
#include "server/kinds/linkages/scene.h"
#include "server/runtime/export_parts.h"
#include "server/wire/errors.h"
#include "server/wire/file_stem.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

Eigen::Matrix3Xd points_of(const Eigen::VectorXd& nodes) {
  return nodes.reshaped(3, nodes.size() / 3);
}

/// The shapes of one final result.
struct LinkageExport {
  std::shared_ptr<const session::LinkageResult> result;
  std::shared_ptr<const session::LinkageShape> shape;
  std::string stem;

  [[nodiscard]] session::LinkageDetail detail(Eigen::Index step) const {
    return result->statics->detail(result->frames->col(step), result->strains->col(step));
  }

  [[nodiscard]] proto::ExportResponse vtp(std::uint32_t part) const {
    const auto steps = static_cast<std::uint32_t>(result->frames->cols());
    // Point data are a dozen fields and a director; the rest is small in comparison.
    const std::size_t bytes = static_cast<std::size_t>(result->statics->stations()) * 80 + 4000;
    const auto at_once = static_cast<std::uint32_t>(
        std::clamp<std::size_t>(kPartBytes / bytes, 1, std::max(steps, 1U)));
    const std::uint32_t parts = (steps + at_once - 1) / at_once;
    if (part >= parts) refuse_part(part, parts);
    proto::ExportResponse response;
    response.set_part(part);
    response.set_part_count(parts);
    const auto name = [&](std::uint32_t step) { return fmt::format("{}_{:05}.vtp", stem, step); };
    if (part == 0) {
      std::vector<std::string> files;
      std::vector<double> times;
      for (std::uint32_t step = 0; step < steps; ++step) {
        files.push_back(name(step));
        times.push_back(step);
      }
      add_file(response, stem + ".pvd", scene::write_pvd(files, times));
    }
    const std::uint32_t first = part * at_once;
    for (std::uint32_t step = first; step < std::min(steps, first + at_once); ++step)
      add_file(response, name(step), scene::write_vtp(session::linkage_lines(detail(step))));
    return response;
  }

  [[nodiscard]] std::vector<TextFile> obj() const {
    const Eigen::Index last = result->frames->cols() - 1;
    return {{stem + "_centrelines.obj",
             scene::write_obj_lines(session::linkage_centrelines(detail(last)))},
            {stem + "_surface.obj",
             scene::write_obj(
                 points_of(shape->surface(result->frames->col(last), result->section_scales)),
                 shape->triangles())}};
  }
};

/// The lines as they were opened.
scene::Polylines drawn(const rods::LineMesh& mesh) {
  scene::Polylines lines;
  lines.points = mesh.vertices;
  for (Eigen::Index e = 0; e < mesh.edges.cols(); ++e)
    lines.lines.push_back({mesh.edges(0, e), mesh.edges(1, e)});
  return lines;
}

std::vector<TextFile> scene_files(const scene::Linkage& linkage, const std::string& stem) {
  proto::Scene message = encode_linkage(linkage);
  message.mutable_linkage()->mutable_lines()->set_path(stem + ".obj");
  return {{stem + ".json", scene_to_json(message)},
          {stem + ".obj", scene::write_obj_lines(drawn(linkage.lines))}};
}

std::shared_ptr<const session::LinkageResult> result_of(LinkageRecord& record,
                                                        const proto::ExportRequest& request) {
  if (request.part() == 0) record.exports().begin(record.demand_result(true));
  return record.exports().find(request.part() == 0 ? 0 : request.result_sequence());
}

}  // namespace

proto::ExportResponse export_linkage(LinkageRecord& record, const proto::ExportRequest& request) {
  const std::string stem = decode_file_stem(request.stem(), "motion");
  const auto session = record.session();
  switch (request.format()) {
    case proto::EXPORT_FORMAT_SCENE:
      return cut_into_parts(scene_files(session->linkage_in_shape(), stem), request.part());
    case proto::EXPORT_FORMAT_VTP:
    case proto::EXPORT_FORMAT_OBJ:
    case proto::EXPORT_FORMAT_JSON:
      break;
    case proto::EXPORT_FORMAT_UNSPECIFIED:
      throw invalid("format", "unspecified");
    default:
      throw invalid("format", "a rod linkage is exported as VTP, OBJ, JSON or SCENE");
  }
  const auto result = result_of(record, request);
  const LinkageExport files{result, result->shape, stem};
  proto::ExportResponse response;
  if (request.format() == proto::EXPORT_FORMAT_VTP) {
    response = files.vtp(request.part());
  } else if (request.format() == proto::EXPORT_FORMAT_OBJ) {
    response = cut_into_parts(files.obj(), request.part());
  } else {
    const session::LinkageDetail detail = files.detail(files.result->frames->cols() - 1);
    response = cut_into_parts(
        {{stem + "_shape.json", session::linkage_json(detail, session->linkage(),
                                                      *files.result->geometry, *files.result)}},
        request.part());
  }
  *response.mutable_result() = encode_linkage_result(*files.result, record.opened().length_unit);
  return response;
}

}  // namespace limber::server
