#pragma once

#include <vector>

#include "engine/spacetime/problem.h"

namespace limber::session {

/// A motion of fewer frames is published as a whole before anybody could see a part of it.
constexpr int kLongMotion = 8192;
/// Frames that come early after an edit, of all spans together; about a millisecond.
constexpr int kEarlyFrames = 4096;
/// Spans that clients look at, the newest ones.
constexpr std::size_t kViews = 8;

/// Spans to publish early, in the order of their frames and disjoint: the viewed ones, newest
/// first, then those around edited frames, up to kEarlyFrames.
/// @param views  newest first
/// @param edited  frames, in any order
/// @param frame_count  of the motion
[[nodiscard]] std::vector<spacetime::FrameSpan> choose_early_spans(
    const std::vector<spacetime::FrameSpan>& views, const std::vector<int>& edited,
    int frame_count);

}  // namespace limber::session
