#pragma once

namespace limber::bodies {

/// Corners of the face opposite corner f of a positively oriented tet, counter-clockwise from
/// outside.
inline constexpr int kTetFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

}  // namespace limber::bodies
