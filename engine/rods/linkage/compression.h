#pragma once

namespace limber::rods {

/// What compressed edges do in the Hessian of a linkage. Their pressure pushes them aside, which is
/// exact; but where a guess has shortened rods that only had to turn, it makes the Hessian
/// indefinite for no good reason. Left out, the rest leads back to where rods have their length.
enum class Compression { kBuckles, kLeftOut };

}  // namespace limber::rods
