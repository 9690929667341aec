#pragma once

#include <cstdint>

#include "engine/beams/model/beam_model.h"
#include "engine/beams/results/stations.h"

namespace limber::server {

/// Peak memory of solving a structure of beams [bytes], from its sizes alone and rather too high.
/// It covers second derivatives and their factor, states, the answer in numbers and in files, and
/// the shapes along the path. @param stations  along each element
[[nodiscard]] std::uint64_t estimate_beam_bytes(const beams::BeamModel& model, int shapes,
                                                int stations = beams::kDefaultStations);
/// The same of the model with its elements cut into so many.
[[nodiscard]] std::uint64_t estimate_cut_beam_bytes(const beams::BeamModel& model, int elements,
                                                    int shapes,
                                                    int stations = beams::kDefaultStations);

}  // namespace limber::server
