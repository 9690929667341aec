#include "tests/support/charted_element.h"

#include <Eigen/Geometry>
#include <cmath>

#include "tests/support/normal_chart.h"

namespace limber::beams {

namespace {

using Eigen::Vector3d;

using Kind = ChartedReference::Kind;

/// theta_3 at one end: t_1 x f_2 on the normal, f_2 as (32) to (37) make it of the reference.
struct Director {
  Kind kind;
  double angle;                    // theta_3
  Vector3d k = Vector3d::Zero();   // t_1 of the reference
  Vector3d f1 = Vector3d::Zero();  // of unit length
  Vector3d f2 = Vector3d::Zero();
  double size = 1;              // of the reference's vector
  double flat = 1;              // |f_1| before
  double cosine = 1, sine = 0;  // of n_r + alpha

  Director(const ChartedReference& reference, const Vector3d& n, const Vector3d& t1, double n_r)
      : kind(reference.kind), angle(n_r) {
    if (kind == Kind::kItself) return;
    size = reference.vector.norm();
    k = reference.vector / size;
    f2 = k;
    if (kind == Kind::kElement) {
      const Vector3d across = k - k.dot(n) * n;
      flat = across.norm();
      f1 = across / flat;
      cosine = std::cos(n_r + reference.alpha);
      sine = std::sin(n_r + reference.alpha);
      f2 = cosine * f1 + sine * n.cross(f1);
    }
    angle = t1.cross(f2).dot(n);
  }
};

/// Derivatives of an energy whose derivative by theta_3 is `weight`; those by t_1 and n are added.
struct DirectorGradient {
  double n_r = 0;
  Vector3d vector = Vector3d::Zero();

  DirectorGradient(const Director& d, double weight, const Vector3d& n, const Vector3d& t1,
                   Vector3d& by_t1, Vector3d& by_n) {
    if (d.kind == Kind::kItself) {
      n_r = weight;
      return;
    }
    by_t1 += weight * d.f2.cross(n);
    by_n += weight * t1.cross(d.f2);
    const Vector3d by_f2 = weight * n.cross(t1);
    Vector3d by_k = by_f2;
    if (d.kind == Kind::kElement) {
      n_r = by_f2.dot(d.cosine * n.cross(d.f1) - d.sine * d.f1);
      Vector3d by_f1 = d.cosine * by_f2 + d.sine * by_f2.cross(n);
      by_f1 = (by_f1 - by_f1.dot(d.f1) * d.f1) / d.flat;
      by_n += d.sine * d.f1.cross(by_f2) - d.k.dot(n) * by_f1 - by_f1.dot(n) * d.k;
      by_k = by_f1 - by_f1.dot(n) * n;
    }
    vector = (by_k - by_k.dot(d.k) * d.k) / d.size;
  }
};

/// The element frame of (3) to (6) and the angles of (17), (24) and sec. 2.4.
struct Charted {
  ChartedNormal a, b;
  double length;
  Vector3d t1, t2;
  double side;  // |n_k x t_1|
  double sum;   // |n_a + n_b|
  double twist, angle_a, angle_b;

  Charted(const ChartedVector& u, double rim)
      : a(normal_of_chart(u[3], u[4], rim)), b(normal_of_chart(u[9], u[10], rim)) {
    const Vector3d v = u.segment<3>(6) - u.segment<3>(0);
    const Vector3d both = a.normal + b.normal;
    length = v.norm();
    t1 = v / length;
    sum = both.norm();
    const Vector3d across = (both / sum).cross(t1);
    side = across.norm();
    t2 = across / side;
    twist = t2.dot(a.normal - b.normal);
    angle_a = t1.dot(a.normal);
    angle_b = t1.dot(b.normal);
  }
};

double bending(double stiffness, double a, double b) {
  return 2 * stiffness * (a * a + a * b + b * b);
}

}  // namespace

double charted_alpha(const Vector3d& normal, const Vector3d& reference, const Vector3d& element) {
  const Vector3d n = normal.normalized();
  const Vector3d f1 = reference - reference.dot(n) * n;
  return std::atan2(n.cross(f1).dot(element), f1.dot(element));
}

double charted_energy(const ChartedElement& e, const ChartedReferences& references,
                      const ChartedVector& unknowns) {
  const Charted q(unknowns, e.rim);
  const Director start(references[0], q.a.normal, q.t1, unknowns[5]);
  const Director finish(references[1], q.b.normal, q.t1, unknowns[11]);
  const double stretch = q.length - e.length;
  return (0.5 * e.stretching * stretch * stretch + 0.5 * e.torsion * q.twist * q.twist +
          bending(e.bending_2, q.angle_a, q.angle_b) +
          bending(e.bending_3, start.angle, finish.angle)) /
         e.length;
}

ChartedGradient charted_gradient(const ChartedElement& e, const ChartedReferences& references,
                                 const ChartedVector& unknowns) {
  const Charted q(unknowns, e.rim);
  const Vector3d &n_a = q.a.normal, &n_b = q.b.normal;
  const Director start(references[0], n_a, q.t1, unknowns[5]);
  const Director finish(references[1], n_b, q.t1, unknowns[11]);
  const double first = 2 * e.bending_2 / e.length, second = 2 * e.bending_3 / e.length;
  const double by_a = first * (2 * q.angle_a + q.angle_b);
  const double by_b = first * (2 * q.angle_b + q.angle_a);
  const double by_twist = e.torsion * q.twist / e.length;
  // Twist by t_2, and that by what it is made of: n_k x t_1, normalised twice.
  const Vector3d by_t2 = by_twist * (n_a - n_b);
  const Vector3d by_across = (by_t2 - by_t2.dot(q.t2) * q.t2) / q.side;
  const Vector3d n_k = (n_a + n_b) / q.sum;
  const Vector3d by_n_k = q.t1.cross(by_across);
  const Vector3d by_sum = (by_n_k - by_n_k.dot(n_k) * n_k) / q.sum;
  Vector3d by_t1 = by_a * n_a + by_b * n_b + by_across.cross(n_k);
  Vector3d by_n_a = by_a * q.t1 + by_twist * q.t2 + by_sum;
  Vector3d by_n_b = by_b * q.t1 - by_twist * q.t2 + by_sum;
  const DirectorGradient at_start(start, second * (2 * start.angle + finish.angle), n_a, q.t1,
                                  by_t1, by_n_a);
  const DirectorGradient at_finish(finish, second * (2 * finish.angle + start.angle), n_b, q.t1,
                                   by_t1, by_n_b);
  const Vector3d by_v = (by_t1 - by_t1.dot(q.t1) * q.t1) / q.length +
                        e.stretching * (q.length - e.length) / e.length * q.t1;
  ChartedGradient gradient;
  gradient.unknowns.segment<3>(0) = -by_v;
  gradient.unknowns.segment<2>(3) = q.a.derivative.transpose() * by_n_a;
  gradient.unknowns[5] = at_start.n_r;
  gradient.unknowns.segment<3>(6) = by_v;
  gradient.unknowns.segment<2>(9) = q.b.derivative.transpose() * by_n_b;
  gradient.unknowns[11] = at_finish.n_r;
  gradient.references = {at_start.vector, at_finish.vector};
  return gradient;
}

}  // namespace limber::beams
