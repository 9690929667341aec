#include "engine/beams/element/element_energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/rotations/exponential_map.h"

namespace limber::beams {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Derivatives by d = p_b - p_a and the spins of start and finish.
enum Block { kChord = 0, kStartSpin = 3, kFinishSpin = 6 };

NaturalModes<double> modes(const ElementConstants<double>& constants, const ElementEnds& ends) {
  return {constants, vec(ends.finish - ends.start), triad(ends.start_axes),
          triad(ends.finish_axes)};
}

/// The chord, and the data for derivatives by it.
struct Chord {
  Vector3d t;
  double inverse;       // 1/l
  Matrix3d transverse;  // P = I - t t^T
};

/// First and second derivatives of functions of one end's angles.
class EndDerivatives {
 public:
  EndDerivatives(const Chord& chord, const Matrix3d& axes, const EndAngles<double>& angles,
                 Block spin)
      : chord_(chord), axes_(axes), k_(angles), spin_(spin) {
    for (int i = 0; i < 3; ++i) {
      y_[i].setZero();
      y_[i].segment<3>(kChord) = chord.inverse * (chord.transverse * axes.col(i));
      y_[i].segment<3>(spin) = axes.col(i).cross(chord.t);
    }
    const double g = k_.factor, slope = -g * g / 3;
    angle_2_ = g * y_[2] + slope * k_.s3 * y_[0];
    angle_3_ = -g * y_[1] - slope * k_.s2 * y_[0];
  }

  [[nodiscard]] const Vector9d& angle_2() const { return angle_2_; }
  [[nodiscard]] const Vector9d& angle_3() const { return angle_3_; }

  /// Adds m2 d2 angle_2 + m3 d2 angle_3.
  void add_bending(double m2, double m3, Matrix9d& h) const {
    const double g = k_.factor, first = -g * g / 3, second = 2 * g * g * g / 9;
    const double along = m2 * k_.s3 - m3 * k_.s2;
    add_linear(axes_ * Vector3d(first * along, -g * m3, g * m2), h);
    const Vector9d mixed = first * (m2 * y_[2] - m3 * y_[1]) + (0.5 * second * along) * y_[0];
    h += mixed * y_[0].transpose() + y_[0] * mixed.transpose();
  }

  /// Spin of this end about the chord, as the twist sees it: e = (x1 + t) / (1 + c).
  [[nodiscard]] Vector3d lever() const { return k_.inverse * (axes_.col(0) + chord_.t); }

  /// Adds weight times the second derivatives of the twist by this end's unknowns.
  void add_twist(double weight, Matrix9d& h) const {
    const Vector3d e = lever(), x1 = axes_.col(0), k = x1.cross(chord_.t);
    const double w = weight * k_.inverse;
    h.block<3, 3>(spin_, spin_) -= (0.5 * w) * (e * k.transpose() + k * e.transpose());
    // d e / d d, and with it the turning of t x e / l.
    const Matrix3d by_chord =
        (w * chord_.inverse) * (chord_.transverse - e * (chord_.transverse * x1).transpose());
    h.block<3, 3>(spin_, kChord) += by_chord;
    h.block<3, 3>(kChord, spin_) += by_chord.transpose();
    const Vector3d te = chord_.t.cross(e);
    h.block<3, 3>(kChord, kChord) +=
        chord_.inverse * (rotations::cross_matrix(chord_.t) * by_chord) -
        (weight * chord_.inverse * chord_.inverse) *
            (te * chord_.t.transpose() + rotations::cross_matrix(e) * chord_.transverse);
  }

 private:
  /// Adds second derivatives of t . w for w that turns with this end.
  void add_linear(const Vector3d& w, Matrix9d& h) const {
    const Vector3d& t = chord_.t;
    const double tw = t.dot(w), i = chord_.inverse;
    const Vector3d pw = chord_.transverse * w;
    h.block<3, 3>(kChord, kChord) -=
        (i * i) * (pw * t.transpose() + t * pw.transpose() + tw * chord_.transverse);
    const Matrix3d cross = -i * chord_.transverse * rotations::cross_matrix(w);
    h.block<3, 3>(kChord, spin_) += cross;
    h.block<3, 3>(spin_, kChord) += cross.transpose();
    h.block<3, 3>(spin_, spin_) +=
        0.5 * (w * t.transpose() + t * w.transpose()) - tw * Matrix3d::Identity();
  }

  const Chord& chord_;
  const Matrix3d& axes_;
  const EndAngles<double>& k_;
  Block spin_;
  Vector9d y_[3];  // of t . x_1, t . x_2, t . x_3
  Vector9d angle_2_, angle_3_;
};

/// Adds one plane of bending: near and far stiffness, and with `pull` the effect of bowing.
void add_plane(double near, double far, double pull, const Vector9d& start, const Vector9d& finish,
               Matrix9d& h) {
  const Vector9d by_start = (near + 4 * pull) * start + (far - pull) * finish;
  const Vector9d by_finish = (near + 4 * pull) * finish + (far - pull) * start;
  h += start * by_start.transpose() + finish * by_finish.transpose();
}

/// The response as if the axial force were zero.
void leave_out_axial(const ElementConstants<double>& k, const NaturalModes<double>& q,
                     ElementResponse<double>& r) {
  r.axial = 0;
  r.start_2 = k.near_2 * q.start_2 + k.far_2 * q.finish_2;
  r.finish_2 = k.near_2 * q.finish_2 + k.far_2 * q.start_2;
  r.start_3 = k.near_3 * q.start_3 + k.far_3 * q.finish_3;
  r.finish_3 = k.near_3 * q.finish_3 + k.far_3 * q.start_3;
}

/// Share of the stiffness EA / L.
double shown_share(const ElementConstants<double>& k, const ElementEnds& ends) {
  if (k.least_stretch < -1) return 1;  // a beam
  switch (cable_tension(k, ends)) {
    case CableTension::kSlack:
      return 0;
    case CableTension::kJustTaut:
      return 0.5;
    case CableTension::kPulled:
      break;
  }
  return 1;
}

/// The response as if the element carried nothing.
void leave_out_forces(ElementResponse<double>& r) {
  r.axial = r.twisting = 0;
  r.start_2 = r.finish_2 = r.start_3 = r.finish_3 = 0;
}

Matrix9d relative_hessian(const ElementConstants<double>& k, const ElementEnds& ends,
                          Compression compression) {
  const NaturalModes<double> q = modes(k, ends);
  ElementResponse<double> r(k, q, triad(ends.start_axes), triad(ends.finish_axes));
  if (compression == Compression::kLeftOut && r.axial < 0) leave_out_axial(k, q, r);
  if (compression == Compression::kWithAllForcesLeftOut) leave_out_forces(r);
  const Vector3d t = eigen(q.t);
  const Chord chord{t, 1 / q.chord, Matrix3d::Identity() - t * t.transpose()};
  const EndDerivatives a(chord, ends.start_axes, q.start, kStartSpin);
  const EndDerivatives b(chord, ends.finish_axes, q.finish, kFinishSpin);
  Matrix9d h = Matrix9d::Zero();

  // Stretch with bowing.
  const double stiffness = shown_share(k, ends) * k.stretching, pull = k.bow * r.axial;
  Vector9d stretch = k.bow * ((4 * q.start.angle_2 - q.finish.angle_2) * a.angle_2() +
                              (4 * q.finish.angle_2 - q.start.angle_2) * b.angle_2() +
                              (4 * q.start.angle_3 - q.finish.angle_3) * a.angle_3() +
                              (4 * q.finish.angle_3 - q.start.angle_3) * b.angle_3());
  stretch.segment<3>(kChord) += t;
  h += stiffness * stretch * stretch.transpose();
  h.block<3, 3>(kChord, kChord) += (r.axial * chord.inverse) * chord.transverse;
  add_plane(k.near_2, k.far_2, pull, a.angle_2(), b.angle_2(), h);
  add_plane(k.near_3, k.far_3, pull, a.angle_3(), b.angle_3(), h);
  a.add_bending(r.start_2, r.start_3, h);
  b.add_bending(r.finish_2, r.finish_3, h);

  Vector9d twist;
  twist.segment<3>(kChord) = chord.inverse * t.cross(b.lever() - a.lever());
  twist.segment<3>(kStartSpin) = -a.lever();
  twist.segment<3>(kFinishSpin) = b.lever();
  const double g = 1 / (2 + q.half);
  // d2 q_1 / d angle^2; sin = 2 sin(angle / 2) half
  const double curvature = -1.5 * (q.sine / q.half) * (1 - q.half) * g * g * g;
  const double carried =
      compression == Compression::kWithAllForcesLeftOut ? 0 : q.twist * curvature;
  h += (k.torsion * (q.twist_slope * q.twist_slope + carried)) * twist * twist.transpose();
  a.add_twist(-r.twisting, h);
  b.add_twist(r.twisting, h);
  return h;
}

}  // namespace

Triad<double> triad(const Eigen::Matrix3d& axes) {
  return {vec(axes.col(0)), vec(axes.col(1)), vec(axes.col(2))};
}

ElementEnergies<double> element_energies(const ElementConstants<double>& constants,
                                         const ElementEnds& ends) {
  return {constants, modes(constants, ends)};
}

double twist_angle(const ElementConstants<double>& constants, const ElementEnds& ends) {
  const NaturalModes<double> q = modes(constants, ends);
  return std::atan2(q.sine, q.cosine);
}

CableTension cable_tension(const ElementConstants<double>& k, const ElementEnds& ends) {
  const double stretch = (ends.finish - ends.start).norm() - k.length;
  // A length is a difference of coordinates.
  const double farthest =
      std::max(ends.start.cwiseAbs().maxCoeff(), ends.finish.cwiseAbs().maxCoeff());
  const double rounding = 16 * std::numeric_limits<double>::epsilon() * (k.length + farthest);
  if (std::abs(stretch) <= rounding) return CableTension::kJustTaut;
  return stretch > 0 ? CableTension::kPulled : CableTension::kSlack;
}

ElementVector element_gradient(const ElementConstants<double>& constants, const ElementEnds& ends) {
  const ElementResponse<double> r(constants, modes(constants, ends), triad(ends.start_axes),
                                  triad(ends.finish_axes));
  ElementVector gradient;
  gradient.segment<3>(0) = -eigen(r.force);
  gradient.segment<3>(3) = eigen(r.start_moment);
  gradient.segment<3>(6) = eigen(r.force);
  gradient.segment<3>(9) = eigen(r.finish_moment);
  return gradient;
}

ElementMatrix element_hessian(const ElementConstants<double>& constants, const ElementEnds& ends,
                              Compression compression) {
  const Matrix9d h = relative_hessian(constants, ends, compression);
  ElementMatrix full;
  const auto chord = h.block<3, 3>(kChord, kChord);
  const auto start = h.block<3, 3>(kChord, kStartSpin), finish = h.block<3, 3>(kChord, kFinishSpin);
  const auto both = h.block<3, 3>(kStartSpin, kFinishSpin);
  full << chord, -start, -chord, -finish,                                                  //
      -start.transpose(), h.block<3, 3>(kStartSpin, kStartSpin), start.transpose(), both,  //
      -chord, start, chord, finish,                                                        //
      -finish.transpose(), both.transpose(), finish.transpose(),                           //
      h.block<3, 3>(kFinishSpin, kFinishSpin);
  return full;
}

}  // namespace limber::beams
