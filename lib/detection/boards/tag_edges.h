// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/tag_pattern.h"

namespace vlp {

/// Refines the corners of tags in an image: moves them to the intersections of the four edges of
/// each tag. Sets curvatures, standard deviations of the corners, and steps.
///
/// @param tags   tags with the corners of libapriltag; corrected in place
/// @param image  gray levels of 8 bits
/// @return       BoardDetection::curve_costs, from the eight widest tags
///
/// Edges. Each edge is fitted to the pixels next to it, from corner to corner, as a parabola,
/// because the lens bends it (fit_edge_curve()). The pixels are first those next to
/// libapriltag's straight lines. At the rim of a wide lens these lines miss the corners by up to 4
/// px. If the sagitta of an edge exceeds 0.5 px, all four edges are therefore fitted again to the
/// pixels next to the fitted curve. Above 1 px the curve has a cubic term.
///
/// Limits. On rendered boards corners are accurate to 0.02 px, also for tags of 16 px and at the
/// rim of a lens of 190 degrees. A tag keeps its corners if the fit of an edge fails. It also keeps
/// them if a corner would move by more than max(1.5 px, 3 % of the width) plus the largest edge
/// curvature.
///
/// Tone curve. A tone curve makes an edge steeper on its dark side, which biases the fit towards
/// that side. The bias grows as the stripes get narrower. Edges are therefore fitted for each of
/// kGammas (TagDetection::tone_curve_fits), unless the image shows that it has no tone curve.
///
/// Blur and saturation. With a tone curve, and even more if white is saturated, the blur, contrast
/// and position of an edge are strongly correlated. At an exposure of 1.5 times white, a known blur
/// improves the standard deviation of the position by a factor of 10. The known light of the bright
/// side improves it by another factor of 2.5. Both change slowly over an image (EdgeField). Edges
/// are therefore fitted again with the blur of the neighboring edges as a prior, and in saturated
/// images once more with their light. The prior allows for the differences between edges that
/// exceed their noise.
std::vector<double> refine_tags(std::span<TagDetection> tags, const cv::Mat1b& image,
                                const TagGeometry& print);

}  // namespace vlp
