#include "engine/bodies/material.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"

namespace limber::bodies {
namespace {

void demand_member(bool valid, const char* field, const char* member, double value,
                   const char* rule) {
  if (valid) return;
  throw Error(ErrorCode::kInvalidArgument,
              *field == '\0' ? std::string(member) : fmt::format("{}.{}", field, member),
              fmt::format("{} must be {}, not {}", member, rule, value));
}

}  // namespace

void Material::validate(const char* field) const {
  demand_member(std::isfinite(youngs_modulus) && youngs_modulus > 0, field, "youngs_modulus",
                youngs_modulus, "finite and > 0 Pa");
  demand_member(poissons_ratio > -1 && poissons_ratio < 0.5, field, "poissons_ratio",
                poissons_ratio, "in (-1, 0.5)");
  demand_member(std::isfinite(density) && density > 0, field, "density", density,
                "finite and > 0 kg/m^3");
}

}  // namespace limber::bodies
