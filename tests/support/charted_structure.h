#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/model/beam_model.h"
#include "tests/support/charted_element.h"

namespace limber::testing {

/// By node: position, n_x, n_y, n_r (bending-active, sec. 2).
using ChartedUnknowns = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// A structure by the paper's unknowns: what its elements and loads do to them. Baseline of the
/// benchmark, to compare with.
///
/// Rotations held about x, y and z are n_y, n_x and n_r held. Where n_r is held, elements are
/// compared with their own directions at rest: counted from an element as it is, a held n_r would
/// hold that one's end angle and let the node turn (the public code does so where all six unknowns
/// are held). A moment's part along the normal is the force on n_r.
class ChartedStructure {
 public:
  /// @throws Error{kUnsupported} naming what the paper's elements do not have: cables, releases,
  ///   rest curvature, normals of elements, following and distributed loads, gravity, prescribed
  ///   turns, supports along other axes, normals at or below the equator
  explicit ChartedStructure(const beams::BeamModel& model);

  [[nodiscard]] int nodes() const { return static_cast<int>(rest_.cols()); }
  [[nodiscard]] const ChartedUnknowns& rest() const { return rest_; }
  /// Brings nodes with prescribed motions to a share of their path.
  void drive(ChartedUnknowns& unknowns, double share) const;

  enum class Temporary { kOn, kOff };
  /// Loads less the forces of elements on the unknowns; zero on those that are held.
  [[nodiscard]] ChartedUnknowns unbalanced(const ChartedUnknowns& unknowns, Temporary loads) const;
  [[nodiscard]] double elastic_energy(const ChartedUnknowns& unknowns) const;

  /// Lumped masses of the public code, for steps of unit time: 2 EA / l for translations and
  /// 8 E (I_2 + I_3) / l^3 for n_x, n_y and n_r, summed over the elements of a node. The latter has
  /// not the unit of the stiffness, EI / l, so that elements longer than a few units of length are
  /// too quick for their steps.
  struct Masses {
    Eigen::ArrayXd translation, rotation;
  };
  [[nodiscard]] Masses masses(const ChartedUnknowns& unknowns) const;

  [[nodiscard]] bool has_motions() const { return !motions_.empty(); }
  [[nodiscard]] bool has_temporary_loads() const { return !temporary_.empty(); }

 private:
  struct End {
    int node = 0;
    int element = 0;  // its reference
    beams::ChartedReference reference;
  };
  struct Element {
    beams::ChartedElement constants;
    std::array<End, 2> ends;
  };
  [[nodiscard]] Eigen::Vector3d along(const ChartedUnknowns& unknowns, const Element& e) const;
  [[nodiscard]] beams::ChartedReferences references(const ChartedUnknowns& unknowns,
                                                    const Element& e) const;
  [[nodiscard]] beams::ChartedVector gathered(const ChartedUnknowns& unknowns,
                                              const Element& e) const;
  void add_loads(const std::vector<beams::NodalLoad>& loads, const ChartedUnknowns& unknowns,
                 ChartedUnknowns& forces) const;
  void add_elements(const beams::BeamModel& model);
  void hold(const beams::BeamModel& model);
  void choose_references();

  ChartedUnknowns rest_;
  Eigen::Array<bool, 6, Eigen::Dynamic> held_;
  std::vector<Element> elements_;
  std::vector<beams::NodalLoad> loads_, temporary_;
  std::vector<beams::PrescribedMotion> motions_;
};

}  // namespace limber::testing
