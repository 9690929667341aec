#pragma once

#include <cmath>

namespace limber::session {

/// Scene lengths to metres and back. Millimetres are divided by 1000, not multiplied by 0.001: 100
/// mm and 0.1 m are then the same double, and the same scene in either unit the same problem.
class LengthUnit {
 public:
  explicit LengthUnit(double metres) : numerator_(metres) {
    const double inverse = std::round(1 / metres);
    if (metres < 1 && inverse <= 1e9 && std::abs(inverse * metres - 1) < 1e-12) {
      numerator_ = 1;
      denominator_ = inverse;
    }
  }

  /// @param length  a number or an Eigen expression [scene length unit]; the result refers to it
  template <class Length>
  [[nodiscard]] auto to_si(const Length& length) const {
    return length * numerator_ / denominator_;
  }
  template <class Length>
  [[nodiscard]] auto to_scene(const Length& length) const {
    return length * denominator_ / numerator_;
  }

 private:
  double numerator_, denominator_ = 1;
};

}  // namespace limber::session
