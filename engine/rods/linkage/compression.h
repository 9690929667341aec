#pragma once

namespace limber::rods {

/// What compressed edges do in the Hessian of a linkage. Their pressure pushes them aside, which is
/// exact; but where a guess has shortened rods that only had to turn, it makes the Hessian
/// indefinite for no good reason. Left out, the rest leads back to where rods have their length.
/// kUnstressed leaves all stresses out, as if rods had the present shape at rest: energies and
/// gradient are 0, the Hessian is what material resists and never indefinite.
enum class Compression { kBuckles, kLeftOut, kUnstressed };

}  // namespace limber::rods
