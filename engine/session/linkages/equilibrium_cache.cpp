#include "engine/session/linkages/equilibrium_cache.h"

#include <utility>

namespace limber::session {

void EquilibriumCache::store(const Conditions& conditions, Answer answer) {
  std::erase_if(answers_, [](const auto& entry) { return entry.first.expired(); });
  answers_.insert_or_assign(conditions, std::move(answer));
}

EquilibriumCache::Answer EquilibriumCache::find(const Conditions& conditions) const {
  const auto found = answers_.find(conditions);
  return found == answers_.end() ? nullptr : found->second;
}

}  // namespace limber::session
