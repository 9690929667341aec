#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Which rest lengths a design varies.
enum class LengthVariables {
  kSegments,  // one for each segment, which its edges share (RestLengthMap)
  kEdges,     // one for each edge, by their EdgeNumbers
  kKept,
};

/// Which sections a design varies: scales of LinkageModel::section_scales.
enum class SectionVariables {
  kKept,
  kSegments,  // one for each segment
};

struct DesignVariables {
  LengthVariables lengths = LengthVariables::kSegments;
  SectionVariables sections = SectionVariables::kKept;

  /// @throws Error{kInvalidArgument} with field variables where nothing is varied
  void validate() const;
};

/// Both equilibria of one design, and the sizes of its rods.
struct DesignPoint {
  Eigen::VectorXd lengths;  // rest lengths of segments, L
  LinkageState flat, deployed;
  /// Rest lengths of edges by their EdgeNumbers; empty: those of segments say them.
  Eigen::VectorXd edges = {};
  /// Scales of the segments' sections; empty: all 1.
  Eigen::VectorXd sections = {};
};

/// Gives a model the sizes of a design.
/// @throws Error as LinkageModel::set_segment_lengths, set_edge_lengths, set_section_scales;
/// {kInvalidArgument} with field lengths, edges or sections where their number is wrong
void set_sizes(LinkageModel& model, const DesignPoint& point);

/// The vector of design variables p: the lengths that are varied, then the scales that are.
class DesignVariableMap {
 public:
  /// @throws Error as DesignVariables::validate
  DesignVariableMap(const LinkageModel& model, DesignVariables which);

  [[nodiscard]] const DesignVariables& which() const { return which_; }
  [[nodiscard]] int size() const { return lengths_ + sections_; }
  [[nodiscard]] int lengths() const { return lengths_; }
  [[nodiscard]] int sections() const { return sections_; }

  /// Values for a model in its present state.
  [[nodiscard]] Eigen::VectorXd values(const LinkageModel& model) const;
  /// The design with other variables; the rest stays. Lengths of segments follow those of edges.
  void place(const LinkageModel& model, const Eigen::Ref<const Eigen::VectorXd>& values,
             DesignPoint& point) const;

  /// dp to a direction that leaves the unknowns where they are.
  [[nodiscard]] LinkageVector direction(const Eigen::Ref<const Eigen::VectorXd>& change) const;
  /// Derivatives by lengths, edges and sections to those by p; empty ones are zero.
  [[nodiscard]] Eigen::VectorXd gradient(const LinkageVector& by) const;

 private:
  DesignVariables which_;
  int lengths_ = 0, sections_ = 0;
};

}  // namespace limber::rods
