#pragma once

namespace limber::bodies {

/// Isotropic linear elastic material.
struct Material {
  double youngs_modulus = 1e6;   // E [Pa], > 0, finite
  double poissons_ratio = 0.45;  // nu, in (-1, 0.5)
  double density = 1000;         // rho [kg/m^3], > 0, finite

  /// @throws Error{kInvalidArgument} naming `field` + the member and the violated inequality.
  void validate(const char* field) const;

  /// First Lame parameter, lambda = E nu / ((1 + nu)(1 - 2 nu)) [Pa].
  [[nodiscard]] double lame_lambda() const {
    return youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio));
  }
  /// Second Lame parameter, the shear modulus mu = E / (2 (1 + nu)) [Pa].
  [[nodiscard]] double lame_mu() const { return youngs_modulus / (2 * (1 + poissons_ratio)); }

  bool operator==(const Material&) const = default;
};

}  // namespace limber::bodies
