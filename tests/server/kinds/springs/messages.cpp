#include "tests/server/kinds/springs/messages.h"

#include <fmt/format.h>

#include "server/wire/edits.h"
#include "server/wire/extension.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"
#include "server/wire/session_values.h"
#include "server/wire/vectors.h"
#include "springs.pb.h"

namespace limber::server::springs {
namespace {

namespace messages = limber::springs;

proto::Vector3 vector_message(const Eigen::Vector3d& vector) {
  proto::Vector3 message;
  encode_vector(vector, message);
  return message;
}

chain::SpringEdit decode_edit(const proto::Edit& edit, const std::string& field,
                              WireBudget& budget) {
  if (edit.has_undo()) return session::Undo{};
  if (edit.has_redo()) return session::Redo{};
  const auto* kind = edit_kind(edit);
  if (kind == nullptr) throw invalid(field, "an edit without content");
  const std::string path = field + "." + kind->name();
  if (!edit.has_extension())
    throw invalid(path, "is no edit of chains of springs, and this session is of one");
  messages::ChainEdit message;
  read_extension(edit.extension(), path, message, budget);
  switch (message.edit_case()) {
    case messages::ChainEdit::kMovePin:
      return chain::MovePin{decode_index(message.move_pin().node(), path + ".move_pin.node"),
                            decode_vector(message.move_pin().position())};
    case messages::ChainEdit::kSetLoad:
      return chain::SetLoad{decode_index(message.set_load().node(), path + ".set_load.node"),
                            decode_vector(message.set_load().force())};
    case messages::ChainEdit::kReleasePin:
      return chain::ReleasePin{
          decode_index(message.release_pin().node(), path + ".release_pin.node")};
    case messages::ChainEdit::EDIT_NOT_SET:
      break;
  }
  throw invalid(path, "an edit without content");
}

proto::SolveStatus encode_status(const chain::SpringResult& result) {
  if (!result.is_final) return proto::SOLVE_STATUS_IMPROVED;
  switch (result.report.status) {
    case chain::Status::kConverged:
      return proto::SOLVE_STATUS_CONVERGED;
    case chain::Status::kCancelled:
      return proto::SOLVE_STATUS_CANCELLED;
    case chain::Status::kFailed:
      break;
  }
  return proto::SOLVE_STATUS_STALLED;
}

}  // namespace

chain::Chain decode_chain(const proto::Scene& scene, const std::string& prefix) {
  const std::string field = prefix + "extension";
  demand_extension_alone(scene, prefix);
  messages::Chain message;
  WireBudget budget;
  read_extension(scene.extension(), field, message, budget);
  chain::Chain decoded;
  decoded.nodes.resize(3, message.nodes_size());
  for (int i = 0; i < message.nodes_size(); ++i)
    decoded.nodes.col(i) = decode_vector(message.nodes(i));
  for (const auto& spring : message.springs())
    decoded.springs.push_back({spring.stiffness(), spring.rest_length()});
  for (int i = 0; i < message.pins_size(); ++i) {
    const int node =
        decode_index(message.pins(i).node(), fmt::format("{}.pins[{}].node", field, i));
    decoded.conditions.pins[node] = decode_vector(message.pins(i).position());
  }
  for (int i = 0; i < message.loads_size(); ++i) {
    const int node =
        decode_index(message.loads(i).node(), fmt::format("{}.loads[{}].node", field, i));
    decoded.conditions.loads[node] = decode_vector(message.loads(i).force());
  }
  const auto rename = [&](const std::string& name) {
    return name.empty() ? field : field + "." + field_in(message, name);
  };
  with_fields(rename, [&] { chain::validate(decoded); });
  return decoded;
}

proto::Scene encode_chain(const chain::Chain& chain, const std::string& name) {
  messages::Chain message;
  for (const auto& node : chain.nodes.colwise()) *message.add_nodes() = vector_message(node);
  for (const auto& spring : chain.springs) {
    auto& added = *message.add_springs();
    added.set_stiffness(spring.stiffness);
    added.set_rest_length(spring.rest_length);
  }
  for (const auto& [node, position] : chain.conditions.pins) {
    auto& pin = *message.add_pins();
    pin.set_node(static_cast<std::uint32_t>(node));
    *pin.mutable_position() = vector_message(position);
  }
  for (const auto& [node, force] : chain.conditions.loads) {
    auto& load = *message.add_loads();
    load.set_node(static_cast<std::uint32_t>(node));
    *load.mutable_force() = vector_message(force);
  }
  proto::Scene scene;
  scene.set_name(name);
  *scene.mutable_extension() = write_extension(message);
  return scene;
}

std::vector<chain::SpringEdit> decode_edits(const proto::EditRequest& request) {
  std::vector<chain::SpringEdit> edits;
  WireBudget budget;
  for (int i = 0; i < request.edits_size(); ++i)
    edits.push_back(decode_edit(request.edits(i), fmt::format("edits[{}]", i), budget));
  return edits;
}

proto::ResultInfo encode_result(const chain::SpringResult& result) {
  proto::ResultInfo info = encode_header(result);
  info.set_status(encode_status(result));
  info.set_weight_scale(1);
  if (!result.is_final) return info;
  info.set_message(result.report.message);
  info.set_iterations(static_cast<std::uint32_t>(result.report.iterations));
  info.set_total_energy(result.report.elastic);
  messages::ChainReport report;
  report.set_residual(result.report.residual);
  report.set_elastic_energy(result.report.elastic);
  *info.mutable_extension() = write_extension(report);
  return info;
}

std::uint64_t ChainFrames::bytes(proto::Encoding encoding, int count) const {
  const std::uint64_t size =
      encoding == proto::ENCODING_POSITIONS_QUANTISED ? sizeof(std::uint16_t) : sizeof(float);
  return static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(result_->shape->size()) *
         size;
}

proto::Frames ChainFrames::encode(proto::Encoding encoding, FrameRange range) const {
  proto::Frames frames = frames_of(encode_result(*result_), encoding, range);
  const Eigen::MatrixXf column = result_->shape->reshaped().cast<float>();
  if (is_of_positions(encoding)) {
    set_positions(column.leftCols(range.count), encoding, frames);
  } else {
    set_coordinates(column.leftCols(range.count), frames);
  }
  return frames;
}

}  // namespace limber::server::springs
