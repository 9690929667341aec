#pragma once

#include <vector>

#include "engine/beams/solver/load_path.h"
#include "engine/beams/solver/relaxation_arrays.h"

namespace limber::beams::detail {

enum class ElementKernel {
  kVector,  // several elements at once
  kPlain,   // one after the other: reference for the other
};

/// A structure as masses that move under the imbalance, one step of unit time at a time, until they
/// rest. Kinetic damping stops all of them whenever their energy has passed a maximum.
///
/// Masses are a 3 x 3 matrix for the translation and one for the rotation of each node. They are a
/// quarter of an upper bound of the stiffness at the present state: stable for any unit, stiffness
/// and slenderness. Energy is that of translations and rotations.
class Relaxation {
 public:
  Relaxation(const BeamStructure& structure, const BeamState& start,
             ElementKernel kernel = ElementKernel::kVector);

  /// Loads from now on.
  void set_loads(const NodeLoads& loads);
  /// Brings held nodes to their places on the path at s.
  void drive(const LoadPath& path, double s);
  /// One step.
  void step();
  [[nodiscard]] BeamState state() const;

  /// Imbalance at the last step, by unknowns of the structure (held ones too), and the largest
  /// force and moment at ends of elements.
  struct Residual {
    Eigen::VectorXd unbalanced;
    double present_force = 0, present_moment = 0;
  };
  [[nodiscard]] Residual residual() const;

  [[nodiscard]] double kinetic_energy() const { return kinetic_energy_; }
  /// Largest compression at the last step, over the load at which the element itself would buckle
  /// between hinges; of elements that are not held at both ends.
  [[nodiscard]] double pressure() const;
  /// Largest angle that an end would have against its chord if the moments of the last step bent
  /// one end alone [rad].
  [[nodiscard]] double bend() const;
  /// Largest coordinate.
  [[nodiscard]] double farthest() const;
  [[nodiscard]] int peaks() const { return peaks_; }
  [[nodiscard]] bool finite() const { return finite_; }

 private:
  struct Row {
    double position[3], rotation[4];
    double mobility_t[6], mobility_r[6];  // inverse masses on the free directions
    double velocity[3], spin[3];
    double acceleration[3], angular[3];
    double force[3], moment[3];  // loads
    double reach;                // of the shortest element there, -2nd power [1/length^2]
    int held;                    // where in held_, -1 if free
  };
  /// Projections on the free directions of a node that is held somehow: lower triangles by rows.
  struct Held {
    double translation[6], rotation[6];
  };
  struct Place {
    int force = 0;    // in the responses
    int moment = 0;   //
    double sign = 1;  // of the force
  };
  /// An element with a load over it.
  struct Loaded {
    int element = 0;
    LoadTransfer transfer;
  };
  struct Hinge {
    int end = 0;  // of the structure's released ends
    Place place;
    double mobility[3] = {}, velocity[3] = {}, acceleration[3] = {};
    double moment[3] = {};  // about the released axes
    Eigen::Quaterniond turn;
  };

  [[nodiscard]] Eigen::Matrix3d hinge_axes(const Hinge& hinge) const;
  void out_of_balance(int node, double force[3], double moment[3]) const;
  [[nodiscard]] bool drives(int node) const;
  [[nodiscard]] Eigen::Matrix3d spin_axes(int node) const;
  void follow_swings();
  void gather_masses();
  void respond();
  void turn_loads();
  void spread_loads();
  [[nodiscard]] ElementEnds slot_ends(int element) const;
  void accelerate();
  void accelerate_hinges();
  void move();
  void move_hinges();
  void write_slots();
  [[nodiscard]] Eigen::Matrix3d free_directions(int node, int first) const;

  const BeamStructure& structure_;
  ElementKernel kernel_;
  RelaxationElements elements_;
  LaneRows responses_, bounds_;
  std::vector<FrameSlot> slots_;
  std::vector<Row> rows_;
  std::vector<char> used_;        // per node: 1 where an element uses it
  std::vector<int> first_place_;  // per node, and one more
  std::vector<Place> places_;
  std::vector<Hinge> hinges_;
  std::vector<Held> held_;
  std::vector<int> swings_;  // nodes that are held about one axis alone
  NodeLoads loads_;
  bool loads_follow_ = false;  // those on nodes
  std::vector<Loaded> loaded_;
  double power_ = 0;  // gain of kinetic energy in this step
  double kinetic_energy_ = 0;
  double fastest_ = 0;  // largest spin or speed over length
  int peaks_ = 0;
  int steps_since_masses_ = 0;
  bool finite_ = true;
};

}  // namespace limber::beams::detail
