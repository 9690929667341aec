#include "clients/cpp/material_words.h"

#include <fmt/format.h>

namespace limber::client {

std::string material_words(const v1::Material& material, double length_unit_in_metres) {
  return fmt::format(
      "Young's modulus {:.3g} Pa, Poisson's ratio {:.3g}, {:.4g} kg/m3, 1 unit = {:.4g} m",
      material.youngs_modulus(), material.poissons_ratio(), material.density(),
      length_unit_in_metres);
}

}  // namespace limber::client
