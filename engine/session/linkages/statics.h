#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/rods/linkage/linkage_stresses.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {

/// A shape of a linkage with what its rods carry. Stations are those of rods::LinkageStresses.
/// Lengths in the scene's unit, curvatures and twist per that unit, forces in N, moments in N m,
/// stresses in Pa, angles in rad.
struct LinkageDetail {
  struct Segment {
    std::array<int, 2> joints{};         // at its ends; -1: a free end
    double rest_length = 0, length = 0;  // between its ends
    double section_scale = 1;            // in both directions
  };
  struct Joint {
    Eigen::Vector3d position, normal;
    double opening_angle = 0;
  };
  Eigen::Matrix3Xd points;     // of stations
  Eigen::Matrix3Xd directors;  // d_1 there, unit
  Eigen::Matrix<double, rods::kRodFields, Eigen::Dynamic> fields;
  std::vector<int> first;  // station of each segment, and the number of all
  std::vector<Segment> segments;
  std::vector<Joint> joints;
};

/// Internal forces of the rods of a linkage in its shapes. Strains are kept with a shape's
/// coordinates, as float32: found from those, strains of stiff rods would be all rounding.
class LinkageStatics {
 public:
  /// @param mapped  of this linkage
  LinkageStatics(const MappedLinkage& mapped, const scene::Linkage& linkage);

  /// Strains of a shape: the axial strain of every edge, then kappa_1, kappa_2 and twist of every
  /// vertex between edges (rods::LinkageStrains).
  [[nodiscard]] Eigen::VectorXf strains(const rods::LinkageState& state) const;
  /// @param coordinates  of a shape, see LinkageShape
  /// @param strains      of the same shape
  [[nodiscard]] LinkageDetail detail(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                     const Eigen::Ref<const Eigen::VectorXf>& strains) const;
  /// With the sizes of rods that the shapes have.
  [[nodiscard]] const rods::LinkageModel& model() const { return mapped_.model; }
  [[nodiscard]] const MappedLinkage& mapped() const { return mapped_; }
  [[nodiscard]] const rods::LinkageStressModel& stresses() const { return stresses_; }
  /// Have edges rest lengths that those of segments do not say?
  [[nodiscard]] bool by_edges() const;
  [[nodiscard]] int stations() const { return edges_ + model().variables().segments(); }

 private:
  void place(const Eigen::Ref<const Eigen::VectorXd>& coordinates, LinkageDetail& detail) const;

  MappedLinkage mapped_;
  rods::LinkageStressModel stresses_;
  double length_unit_;
  int edges_ = 0;  // of all segments
};

}  // namespace limber::session
