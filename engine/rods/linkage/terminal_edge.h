#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "engine/base/rotations/exponential_coefficients.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"

// The edge of a segment at a joint as a function of the joint's unknowns (rod linkages, sec. 1.3 to
// 1.5). Its first and second derivatives are taken at the point from which the unknowns are
// counted. Templates of the scalar, so that duals give Hessian-vector products and third
// derivatives.

namespace limber::rods {

/// A joint as it stands. Its unknowns are increments to this: the rotation vector is counted from
/// here, hence zero, and stays far from the exponential map's singularity.
template <class T>
struct JointState {
  Eigen::Matrix<T, 3, 1> position;
  Eigen::Matrix<T, 3, 1> normal;    // unit
  Eigen::Matrix<T, 3, 1> bisector;  // unit, orthogonal to the normal
  T opening_angle;                  // [rad]
  T lengths[2];                     // of the edges of rods A and B

  /// Unit vectors along rods A and B.
  [[nodiscard]] std::array<Eigen::Matrix<T, 3, 1>, 2> tangents() const {
    using std::cos;
    using std::sin;
    const T half = T(0.5) * opening_angle;
    const Eigen::Matrix<T, 3, 1> along = bisector * cos(half);
    const Eigen::Matrix<T, 3, 1> beside = normal.cross(bisector) * sin(half);
    return {along - beside, along + beside};
  }
  [[nodiscard]] Eigen::Matrix<T, 3, 1> tangent(RodOfJoint rod) const { return tangents()[rod]; }
};

/// Data of a joint on which its terminal edge depends.
template <class T>
struct TerminalEdgeSource {
  Eigen::Matrix<T, 3, 1> position;
  Eigen::Matrix<T, 3, 1> normal;
  Eigen::Matrix<T, 3, 1> tangent;  // of the rod, unit
  T length;
  RodOfJoint rod;
  double sign;  // +1: the segment runs along the tangent, -1: against it
};

template <class T>
[[nodiscard]] TerminalEdgeSource<T> terminal_edge_source(const JointState<T>& joint, RodOfJoint rod,
                                                         int sign) {
  return {joint.position, joint.normal, joint.tangent(rod), joint.lengths[rod], rod, double(sign)};
}

/// Vertices of a terminal edge in the direction of the segment, and the angle theta [rad]. Its
/// material frame (d_2 = normal) has turned by theta about the edge, beyond the transport of its
/// frame from the source.
template <class T>
struct TerminalEdge {
  Eigen::Matrix<T, 3, 1> first, second;
  T turn;
};

template <class T>
using JointIncrement = Eigen::Matrix<T, kJointUnknowns, 1>;

namespace detail {

/// exp of a rotation vector as a quaternion (scalar, vector), polynomial in |w|^2 and so smooth at
/// zero for every scalar; good to a few ulps for |w| <= pi.
template <class T>
struct Turn {
  T scalar;
  Eigen::Matrix<T, 3, 1> vector;
};

template <class T>
T half_angle_series(const T& square, int series) {
  constexpr int kCount = 12;
  T sum = T(rotations::detail::kTaylor[series][kCount]);
  for (int k = kCount - 1; k >= 0; --k)
    sum = sum * square + T(rotations::detail::kTaylor[series][k]);
  return sum;
}

/// How a joint's unknowns turn the frames of its terminal edges: about the normal by the opening
/// angle's share, then by the joint's rotation vector.
template <class T>
class JointTurn {
 public:
  JointTurn(const Eigen::Matrix<T, 3, 1>& normal, const JointIncrement<T>& increment)
      : normal_(normal) {
    using std::cos;
    using std::sin;
    const Eigen::Matrix<T, 3, 1> w = increment.template segment<3>(kJointRotation);
    const T square = w.dot(w) * T(0.25);
    scalar_ = half_angle_series(square, 1);
    vector_ = w * (T(0.5) * half_angle_series(square, 0));
    const T quarter = increment[kJointAngle] * T(0.25);
    cosine_ = cos(quarter);
    sine_ = sin(quarter);
  }

  [[nodiscard]] Turn<T> of(RodOfJoint rod) const {
    const T sine = rod == kRodA ? T(-sine_) : sine_;
    return {scalar_ * cosine_ - sine * vector_.dot(normal_),
            vector_ * cosine_ + normal_ * (scalar_ * sine) + vector_.cross(normal_) * sine};
  }

 private:
  Eigen::Matrix<T, 3, 1> normal_, vector_;
  T scalar_, cosine_, sine_;
};

/// The part of a rotation (q_0, q) of a frame beyond the transport of its unit tangent t, [rad]:
/// the twist 2 atan2(q . t, q_0) of the swing-twist decomposition.
template <class T>
T twist_about(const Turn<T>& q, const Eigen::Matrix<T, 3, 1>& tangent) {
  using std::atan2;
  return T(2) * atan2(q.vector.dot(tangent), q.scalar);
}

}  // namespace detail

/// The edge after an increment of the joint's unknowns, |rotation| <= pi.
template <class T>
[[nodiscard]] TerminalEdge<T> terminal_edge(const TerminalEdgeSource<T>& source,
                                            const JointIncrement<T>& increment) {
  const detail::Turn<T> q = detail::JointTurn<T>(source.normal, increment).of(source.rod);
  const Eigen::Matrix<T, 3, 1>& t = source.tangent;
  const Eigen::Matrix<T, 3, 1> qt = q.vector.cross(t);
  const Eigen::Matrix<T, 3, 1> turned = t + (qt * q.scalar + q.vector.cross(qt)) * T(2);
  const T length = source.length + increment[source.rod == kRodA ? kJointLengthA : kJointLengthB];
  const Eigen::Matrix<T, 3, 1> half = turned * (length * T(0.5 * source.sign));
  const Eigen::Matrix<T, 3, 1> centre =
      source.position + increment.template segment<3>(kJointPosition);
  return {centre - half, centre + half, detail::twist_about(q, t) * T(source.sign)};
}

/// Rows: first vertex (3), theta, second vertex (3), as in the segment's chain.
inline constexpr int kTerminalNumbers = 7;
template <class T>
using TerminalJacobian = Eigen::Matrix<T, kTerminalNumbers, kJointUnknowns>;

/// d(first, theta, second) / d(joint's unknowns) at the source:
///
///   d e = w x e + s l eps/2 (n x t) da + s t dl,  d theta = s t . w,  eps = -1 (A), +1 (B)
///
/// with e the edge along the segment (rod linkages, sec. 1.5, with the factor 1/2 that is missing
/// there for the opening angle).
template <class T>
[[nodiscard]] TerminalJacobian<T> terminal_jacobian(const TerminalEdgeSource<T>& source) {
  const Eigen::Matrix<T, 3, 1>& t = source.tangent;
  const T half = source.length * T(0.5 * source.sign);
  TerminalJacobian<T> result = TerminalJacobian<T>::Zero();
  Eigen::Matrix<T, 3, kJointUnknowns> edge = Eigen::Matrix<T, 3, kJointUnknowns>::Zero();
  edge(0, 4) = half * t[2];  // half of -[e]x
  edge(0, 5) = -half * t[1];
  edge(1, 3) = -half * t[2];
  edge(1, 5) = half * t[0];
  edge(2, 3) = half * t[1];
  edge(2, 4) = -half * t[0];
  edge.col(kJointAngle) = source.normal.cross(t) * (half * T(source.rod == kRodA ? -0.5 : 0.5));
  edge.col(source.rod == kRodA ? kJointLengthA : kJointLengthB) = t * T(0.5 * source.sign);
  result.template topRows<3>() = -edge;
  result.template bottomRows<3>() = edge;
  for (int axis = 0; axis < 3; ++axis) {
    result(axis, axis) = T(1);
    result(4 + axis, axis) = T(1);
    result(3, kJointRotation + axis) = t[axis] * T(source.sign);
  }
  return result;
}

/// J^T g, from derivatives by the edge's numbers to those by the joint's unknowns.
template <class T>
[[nodiscard]] JointIncrement<T> terminal_gradient(
    const TerminalEdgeSource<T>& source, const Eigen::Matrix<T, kTerminalNumbers, 1>& gradient) {
  using Vector = Eigen::Matrix<T, 3, 1>;
  const Vector& t = source.tangent;
  const Vector first = gradient.template head<3>();
  const Vector second = gradient.template tail<3>();
  const Vector f = (second - first) * T(0.5 * source.sign);
  JointIncrement<T> result = JointIncrement<T>::Zero();
  result.template segment<3>(kJointPosition) = first + second;
  result.template segment<3>(kJointRotation) =
      t.cross(f) * source.length + t * (gradient[3] * T(source.sign));
  result[kJointAngle] =
      source.normal.cross(t).dot(f) * (source.length * T(source.rod == kRodA ? -0.5 : 0.5));
  result[source.rod == kRodA ? kJointLengthA : kJointLengthB] = f.dot(t);
  return result;
}

/// sum_k g_k d2 v_k / d(joint's unknowns)^2 at the source, for v = (first, theta, second) and the
/// gradient g of the energy by v. With f = s (g_second - g_first) / 2 and u = n x t:
///
///   w w: l (sym(f t^T) - (f . t) I)         w a: eps l/2 (u x f) + s eps/4 g_theta u
///   w l: t x f    a a: -l/4 (f . t)         a l: eps/2 (f . u)
///
/// (rod linkages, sec. 1.5.1, whose coefficient of d2 theta / da dw is 1/4, not 1/2.)
template <class T>
[[nodiscard]] Eigen::Matrix<T, kJointUnknowns, kJointUnknowns> terminal_curvature(
    const TerminalEdgeSource<T>& source, const Eigen::Matrix<T, kTerminalNumbers, 1>& gradient) {
  using Vector = Eigen::Matrix<T, 3, 1>;
  const Vector& t = source.tangent;
  const Vector f =
      (gradient.template tail<3>() - gradient.template head<3>()) * T(0.5 * source.sign);
  const Vector u = source.normal.cross(t);
  const T along = f.dot(t);
  const T& l = source.length;
  const double eps = source.rod == kRodA ? -1 : 1;
  const int length = source.rod == kRodA ? kJointLengthA : kJointLengthB;
  Eigen::Matrix<T, kJointUnknowns, kJointUnknowns> result;
  result.setZero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      result(kJointRotation + i, kJointRotation + j) = (f[i] * t[j] + f[j] * t[i]) * (l * T(0.5));
    result(kJointRotation + i, kJointRotation + i) -= l * along;
  }
  const Vector turning =
      u.cross(f) * (l * T(0.5 * eps)) + u * (gradient[3] * T(0.25 * eps * source.sign));
  const Vector lengthening = t.cross(f);
  for (int i = 0; i < 3; ++i) {
    result(kJointRotation + i, kJointAngle) = turning[i];
    result(kJointAngle, kJointRotation + i) = turning[i];
    result(kJointRotation + i, length) = lengthening[i];
    result(length, kJointRotation + i) = lengthening[i];
  }
  result(kJointAngle, kJointAngle) = l * along * T(-0.25);
  result(kJointAngle, length) = f.dot(u) * T(0.5 * eps);
  result(length, kJointAngle) = result(kJointAngle, length);
  return result;
}

/// The joint after an increment of its unknowns: a new state to count from.
[[nodiscard]] JointState<double> advanced(const JointState<double>& joint,
                                          const JointIncrement<double>& increment);

}  // namespace limber::rods
