#pragma once

#include <map>
#include <memory>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/rod_sizes.h"

namespace limber::session {

/// The outcome of a solve under some conditions.
struct CachedEquilibrium {
  enum class Kind {
    kReached,  // an equilibrium under these conditions
    kStopped,  // there was none that could be found; the shape is the last one before
    kGuess,    // a shape found elsewhere, from which these conditions are still to be solved
  };
  Kind kind = Kind::kGuess;
  rods::LinkageState state;
  rods::Conditions held;                 // what the shape is in equilibrium under
  RodSizes sizes;                        // its rods'
  rods::EquilibriumReport report = {};   // of the shape
  rods::EquilibriumReport attempt = {};  // kStopped: of the solve
  bool is_settled = true;                // is the shape in equilibrium under anything
  /// kStopped: the last equilibrium that was requested and reached before, if any, and under what.
  std::shared_ptr<const CachedEquilibrium> reached_before = {};
  std::weak_ptr<const scene::LinkageConditions> reached_under = {};
};

/// The answers of a session for as long as its document can come back to their conditions: an
/// answer goes with the last other owner of these. Its memory is therefore bounded by the
/// document's, see LinkageLimits::shape_bytes.
class EquilibriumCache {
 public:
  using Conditions = std::shared_ptr<const scene::LinkageConditions>;
  using Answer = std::shared_ptr<const CachedEquilibrium>;

  /// Replaces what there was for the same conditions (the same object).
  void store(const Conditions& conditions, Answer answer);
  /// @returns null where there is none
  [[nodiscard]] Answer find(const Conditions& conditions) const;

 private:
  std::map<std::weak_ptr<const scene::LinkageConditions>, Answer, std::owner_less<>> answers_;
};

}  // namespace limber::session
