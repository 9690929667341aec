#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {
namespace {

template <class T>
void require(bool holds, const char* member, T value, const char* inequality) {
  if (!holds) {
    throw Error(ErrorCode::kInvalidArgument, member,
                fmt::format("ModelOptions::{} = {}, must be {}", member, value, inequality));
  }
}

}  // namespace

void ModelOptions::validate() const {
  require(mode_count > 0, "mode_count", mode_count, "> 0");
  require(tolerance > 1e-6 && tolerance < 1, "tolerance", tolerance, "in (1e-6, 1)");
  require(basis_size >= 0, "basis_size", basis_size, ">= 0 (0: chosen to meet the tolerance)");
  require(cubature_size >= 0, "cubature_size", cubature_size,
          ">= 0 (0: chosen to meet the tolerance)");
  require(training_poses == 0 || training_poses >= 10, "training_poses", training_poses,
          ">= 10, or 0 (automatic)");
  require(test_poses >= 10, "test_poses", test_poses, ">= 10");
  require(amplitude > 0 && amplitude <= 10, "amplitude", amplitude, "in (0, 10]");
}

}  // namespace limber::reduced
