#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/terminal_edge.h"

namespace limber::rods {
struct StateNumbers;
namespace detail {
struct JointEdges;
}  // namespace detail

/// A shape of a linkage: joints, vertices and material frames, and the twist at every vertex in its
/// branch. The reduced unknowns count from here: a state is its own source. Rotations, opening
/// angles and edge angles are therefore always zero in it and never meet a singularity. Moving by
/// an increment makes a new state.
class LinkageState {
 public:
  /// The shape as drawn: joints as in the graph, terminal edges of their rest length, segments
  /// straight between them, twist spread evenly between the frames of their ends.
  explicit LinkageState(const LinkageModel& model);
  /// The shape that had these numbers. Directors are made orthonormal, terminal edges follow from
  /// the joints, and twists are those of the frames, in the branch next to the numbers.
  /// @throws Error as validate(StateNumbers)
  LinkageState(const LinkageModel& model, const StateNumbers& numbers);
  [[nodiscard]] StateNumbers numbers(const LinkageModel& model) const;

  /// The shape after an increment of the reduced unknowns, |rotations| <= pi. Frames of edges move
  /// by the smallest rotation to the new tangent, then turn by their angle (finite transport).
  /// With kVertices frames and twists stay as they were: good for lengths.
  enum class Parts { kAll, kVertices };
  [[nodiscard]] LinkageState moved(const LinkageModel& model,
                                   const Eigen::Ref<const Eigen::VectorXd>& increment,
                                   Parts parts = Parts::kAll) const;

  /// The shape with one component of the graph carried along as it is, by any motion: opening
  /// angles, lengths and twists stay.
  [[nodiscard]] LinkageState moved_rigidly(const LinkageModel& model, int component,
                                           const Eigen::Isometry3d& motion) const;

  [[nodiscard]] const std::vector<JointState<double>>& joints() const { return joints_; }
  [[nodiscard]] Eigen::Vector3d vertex(const LinkageModel& model, int segment, int index) const;
  /// d_1 of an edge, unit; d_2 = t x d_1.
  [[nodiscard]] Eigen::Vector3d director(const LinkageModel& model, int segment, int edge) const;
  /// From the frame before an interior vertex to the one after it [rad].
  [[nodiscard]] double twist(const LinkageModel& model, int segment, int vertex) const;
  [[nodiscard]] double mean_opening_angle() const;

  /// By slot, for kernels.
  enum Field { kPosition = 0, kDirector = 3, kTwist = 6, kFields = 7 };
  [[nodiscard]] const double* slots(const LinkageModel& model, int batch) const {
    return cells_[model.first_slot(batch) * kFields].values;
  }

 private:
  /// Vertices of a batch after an increment, joints being moved already; turns of its edges.
  void place_batch(const LinkageModel& model, int index,
                   const std::vector<detail::JointEdges>& joint_edges,
                   const Eigen::Ref<const Eigen::VectorXd>& increment, std::vector<double>& turns);
  [[nodiscard]] double* slots(const LinkageModel& model, int batch) {
    return cells_[model.first_slot(batch) * kFields].values;
  }
  [[nodiscard]] double value(const LinkageModel& model, int segment, int slot, int field) const;

  std::vector<JointState<double>> joints_;
  std::vector<detail::LaneCell> cells_;
};

}  // namespace limber::rods
