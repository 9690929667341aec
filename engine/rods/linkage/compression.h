#pragma once

namespace limber::rods {

/// Effect of compressed edges on the Hessian of a linkage. Their pressure pushes them aside, which
/// is exact; but where a guess has shortened rods that only had to turn, it makes the Hessian
/// indefinite for no good reason. Without this effect, the rest leads back to shapes in which rods
/// have their length. kUnstressed leaves all stresses out, as if rods had the present shape at
/// rest. Energies and gradient are then 0; the Hessian is the resistance of the material and never
/// indefinite.
enum class Compression { kBuckles, kLeftOut, kUnstressed };

}  // namespace limber::rods
