// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/tag_print.h"

namespace vlp {

/// Puts the corners of an image's tags where their four edges cross, each fitted to the pixels
/// beside it, from corner to corner, as a parabola, since the lens bends it (fit_edge()). An edge
/// that bends by more than 0.5 px is fitted again to the pixels beside what was found, and beyond
/// 1 px with a cubic term: libapriltag's straight lines, where the pixels are looked for at first,
/// end up to 4 px beside the corners of a tag at the rim of a wide lens. On rendered boards corners
/// are good to 0.02 px, of tags of 16 px and at the rim of a lens of 190 degrees, too. The corners
/// of a tag stay of which an edge looks otherwise, or one would move by more than 1.5 px, and than
/// 3 % of the tag, and what its edges bend.
///
/// Behind a tone curve an edge is steeper on its dark side, which draws the fit there, by more the
/// narrower the stripes are. So they are fitted behind each of kGammas (SeenTag::behind_curves),
/// unless the image tells that there is none.
///
/// Behind a curve, and more so where white runs over, blur, contrast and place of an edge are hard
/// to tell apart: at 1.5 times white its place alone is known ten times worse than with the blur
/// known, and 2.5 times better again with the light that its white would show. Both change slowly
/// over an image (EdgeField). So edges are fitted again with the blur that the others have there,
/// and where white runs over once more with the light, too; each may differ from the others by as
/// much as they do beyond their noise.
///
/// Returns what the eight widest tags tell of the curve (SeenBoard::curve_costs).
std::vector<double> find_exact_edges(std::span<SeenTag> tags, const cv::Mat1b& image,
                                     const TagPrint& print);

}  // namespace vlp
