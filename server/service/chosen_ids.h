#pragma once

#include <cstdint>

#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The largest id that a client may choose: it is exact in a double, and what sessions count on
/// from there does not wrap.
inline constexpr std::uint64_t kLargestChosenId = (std::uint64_t{1} << 53u) - 1;

/// Ids of constraints, keyframes and targets that new edits and scenes add. Stored ones are not
/// checked: earlier servers accepted larger ones.
/// @throws Refusal INVALID_ARGUMENT naming the field, e.g. edits[2].add.constraint.id
void demand_chosen_ids(const proto::EditRequest& request);
/// @throws Refusal INVALID_ARGUMENT naming the field, e.g. scene.constraints[3].id
void demand_chosen_ids(const proto::Scene& scene);
/// The errors of demand_chosen_ids(), added to the issues of a scene.
void add_issues_of_ids(const proto::Scene& scene, proto::ValidateSceneResponse& response);

}  // namespace limber::server
