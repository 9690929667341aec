#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "engine/rods/design/shape_function.h"
#include "engine/rods/design/target_surface.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_model.h"

namespace limber::rods {

/// Elastic energy of the linkage's rods [force length].
class ElasticEnergy final : public ShapeFunction {
 public:
  /// @pre the model outlives this; changes of its rest lengths are seen
  explicit ElasticEnergy(const LinkageModel& model) : assembly_(model) {}

  [[nodiscard]] double value(const LinkageState& state) override;
  [[nodiscard]] double elastic_share() const override { return 1; }
  void add_gradient(const LinkageState&, double, Eigen::Ref<Eigen::VectorXd>) override {}
  void add_second(const LinkageState&, const Eigen::Ref<const Eigen::VectorXd>&, double,
                  Eigen::Ref<Eigen::VectorXd>) override {}

 private:
  LinkageAssembly assembly_;
};

/// A plane through a point, the side of its unit normal above it.
struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

/// Sum of the squared distances of all joints from a plane [length^2]: c of rod linkages, sec. 3,
/// for a linkage that is to lie flat. Without a given plane, the plane is the one nearest to them:
/// c is then the least eigenvalue of the joints' scatter, and does not change as the linkage moves
/// as a whole.
class Flatness final : public ShapeFunction {
 public:
  /// @throws Error{kInvalidArgument} for a normal that is not finite or vanishes
  explicit Flatness(const LinkageModel& model, const std::optional<Plane>& plane = {});

  [[nodiscard]] double value(const LinkageState& state) override;
  void add_gradient(const LinkageState& state, double weight,
                    Eigen::Ref<Eigen::VectorXd> by) override;
  void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                  double weight, Eigen::Ref<Eigen::VectorXd> by) override;

 private:
  [[nodiscard]] Plane plane_at(const LinkageState& state) const;

  const LinkageModel& model_;
  std::optional<Plane> plane_;  // empty: the nearest
};

/// A smooth number below the smallest opening angle [rad]: -log(sum of exp(-k alpha)) / k, by at
/// most log(joints) / k (Kreisselmeier, Steinhauser 1979).
class SmallestAngle final : public ShapeFunction {
 public:
  /// @param sharpness  k > 0
  /// @throws Error{kInvalidArgument} for another
  SmallestAngle(const LinkageModel& model, double sharpness);

  [[nodiscard]] double value(const LinkageState& state) override;
  void add_gradient(const LinkageState& state, double weight,
                    Eigen::Ref<Eigen::VectorXd> by) override;
  void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                  double weight, Eigen::Ref<Eigen::VectorXd> by) override;

 private:
  /// Shares of the joints in the sum, which add up to 1.
  [[nodiscard]] Eigen::VectorXd shares(const LinkageState& state) const;

  const LinkageModel& model_;
  double sharpness_;
};

/// Target of one joint.
struct JointTarget {
  int joint = -1;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [length]
  double weight = 1;                                   // of W, >= 0
};

/// Half the squared distances of some joints to their targets, and of all joints to a surface
/// [length^2], weighed:
///
///   1/2 sum of w |x - t|^2 + 1/2 w_surf sum of w_joint |x - P(x)|^2.
class TargetDistance final : public ShapeFunction {
 public:
  /// @param surface  null: none; else outlives this
  /// @param joint_weights  of the distances to the surface, beside w_surf, >= 0; empty: all 1
  /// @throws Error naming the field: {kOutOfRange} targets[i].joint, {kInvalidArgument} for
  /// positions that are not finite, weights that are negative, and another number of joint_weights
  /// than joints
  TargetDistance(const LinkageModel& model, std::vector<JointTarget> targets,
                 const TargetSurface* surface, double surface_weight,
                 Eigen::VectorXd joint_weights = {});

  [[nodiscard]] double value(const LinkageState& state) override;
  void add_gradient(const LinkageState& state, double weight,
                    Eigen::Ref<Eigen::VectorXd> by) override;
  void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                  double weight, Eigen::Ref<Eigen::VectorXd> by) override;

 private:
  /// The surface's closest points to a state's joints. Value, gradient and every product at one
  /// state ask for the same ones.
  const std::vector<ClosestPoint>& closest_points(const LinkageState& state);

  const LinkageModel& model_;
  std::vector<JointTarget> targets_;
  const TargetSurface* surface_;
  Eigen::VectorXd surface_weights_;      // of each joint
  std::vector<Eigen::Vector3d> sought_;  // positions of the joints, at the last state
  std::vector<ClosestPoint> closest_;    // to them
};

/// A weighed sum of functions.
class SumOfFunctions final : public ShapeFunction {
 public:
  struct Term {
    double weight;
    ShapeFunction& function;  // outlives this
  };
  explicit SumOfFunctions(std::vector<Term> terms) : terms_(std::move(terms)) {}

  [[nodiscard]] double value(const LinkageState& state) override;
  [[nodiscard]] double elastic_share() const override;
  void add_gradient(const LinkageState& state, double weight,
                    Eigen::Ref<Eigen::VectorXd> by) override;
  void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                  double weight, Eigen::Ref<Eigen::VectorXd> by) override;

 private:
  std::vector<Term> terms_;
};

}  // namespace limber::rods
