#include "server/kinds/beams/shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "engine/base/rotations/logarithm.h"
#include "engine/beams/structure/beam_structure.h"
#include "server/wire/arrays.h"

namespace limber::server {
namespace {

proto::Array encode_turns(const std::vector<Eigen::Quaterniond>& turns) {
  Eigen::Matrix3Xd vectors(3, static_cast<Eigen::Index>(turns.size()));
  for (std::size_t i = 0; i < turns.size(); ++i)
    vectors.col(static_cast<Eigen::Index>(i)) = rotations::logarithm(turns[i]);
  return encode_points_float64(vectors);
}

void demand_rows(const Eigen::Matrix3Xd& rows, std::size_t count, const std::string& field,
                 const char* what) {
  if (static_cast<std::size_t>(rows.cols()) != count)
    throw invalid(field, fmt::format("has {} rows, the structure {} {}", rows.cols(), count, what));
}

/// Squares of larger numbers overflow.
constexpr double kLargest = 1e100;

void demand_size(const Eigen::Matrix3Xd& rows, const std::string& field) {
  for (Eigen::Index i = 0; i < rows.cols(); ++i) {
    if (rows.col(i).cwiseAbs().maxCoeff() <= kLargest) continue;
    throw invalid(field, fmt::format("row {} is ({}, {}, {}), at most {:g} is possible", i,
                                     rows(0, i), rows(1, i), rows(2, i), kLargest));
  }
}

std::vector<Eigen::Quaterniond> decode_turns(const proto::Array& array, std::size_t count,
                                             const std::string& field, const char* what) {
  const Eigen::Matrix3Xd vectors = decode_points(array, field);
  demand_rows(vectors, count, field, what);
  demand_size(vectors, field);
  std::vector<Eigen::Quaterniond> turns;
  for (const auto& vector : vectors.colwise()) turns.push_back(beams::rotation_by(vector));
  return turns;
}

/// An element of no length has no direction.
void demand_lengths(const Eigen::Matrix3Xd& positions, const beams::BeamModel& model,
                    const std::string& field) {
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    const int start = model.elements[e].start, finish = model.elements[e].finish;
    const Eigen::Vector3d a = positions.col(start), b = positions.col(finish);
    const double farthest = std::max(a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff());
    if ((b - a).norm() > 1e-12 * farthest) continue;
    throw invalid(
        field, fmt::format("nodes {} and {} coincide, which element {} joins", start, finish, e));
  }
}

}  // namespace

proto::BeamShape encode_beam_shape(const beams::BeamState& state) {
  proto::BeamShape message;
  *message.mutable_positions() = encode_points_float64(state.positions);
  *message.mutable_rotations() = encode_turns(state.rotations);
  if (!state.hinge_turns.empty()) *message.mutable_hinges() = encode_turns(state.hinge_turns);
  return message;
}

beams::BeamState decode_beam_shape(const proto::BeamShape& message, const beams::BeamModel& model,
                                   const std::string& field) {
  beams::BeamState state;
  state.positions = decode_points(message.positions(), field + ".positions");
  demand_rows(state.positions, model.nodes.size(), field + ".positions", "nodes");
  demand_size(state.positions, field + ".positions");
  demand_lengths(state.positions, model, field + ".positions");
  state.rotations =
      decode_turns(message.rotations(), model.nodes.size(), field + ".rotations", "nodes");
  const std::size_t hinged = beams::BeamStructure(model).released_ends().size();
  if (hinged > 0 || message.has_hinges())
    state.hinge_turns =
        decode_turns(message.hinges(), hinged, field + ".hinges", "ends that are hinged");
  return state;
}

}  // namespace limber::server
