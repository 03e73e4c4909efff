// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// How wide the stripes of one colour along a tag's edges are, as shares of the tag's width.
struct EdgeStripes {
  double inside, outside;
};

/// The tags of an image with their corners where their four edges cross. Each edge is fitted to the
/// pixels beside it, from corner to corner, as a parabola, since the lens bends it, by least
/// squares:
///   grey = (middle + contrast step(v - a - b w - c w^2)) (1 + light . (w, v)),
/// with w from -1 to 1 along the edge, v across it and a blurred step. An edge that bends by more
/// than 0.5 px is fitted again to the pixels beside what was found, and beyond 1 px with a cubic
/// term: libapriltag's straight lines, where the pixels are looked for at first, end up to 4 px
/// beside the corners of a tag at the rim of a wide lens. On rendered boards corners are good to
/// 0.02 px, at the rim of a lens of 190 degrees, too; of tags narrower than 25 px they are drawn
/// outwards by some 0.02 px.
///
/// Behind a tone curve, level = 255 (grey / 255)^(1 / gamma), an edge is steeper on its dark side,
/// which draws the fit there, by more the narrower the stripes are. So gamma is 2.2, about that of
/// cameras for people, when that fits the widest tags of the image better than 1: three, or up to
/// eight as long as they leave it open. What is left of another curve is alike all over a view, and
/// found when the lens is (edge_shifts()).
///
/// Levels beyond 250 tell only that: of white that runs over, the step's upper end is not looked
/// at, and gamma is 1 then.
///
/// Nothing for a tag of which an edge looks otherwise, or a corner is more than 1.5 px, and than 3
/// % of the tag, and what its edges bend, from where it was.
std::vector<std::optional<SeenTag>> with_exact_edges(std::span<const SeenTag> tags,
                                                     const cv::Mat1b& image,
                                                     const EdgeStripes& stripes);

}  // namespace vlp
