// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <apriltag/apriltag.h>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "detection/boards/board_detector.h"
#include "geometry/homography.h"
#include "rig/board_layout.h"

namespace vlp {

using TagFamily = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

/// Creates libapriltag's family with a name of Board::family. Detectors must not share it.
/// @throws std::invalid_argument if there is no such family
TagFamily make_tag_family(const std::string& name);

/// Returns the edge length of a tag's square, with its border, in bits. The border is `border_bits`
/// wide on each side instead of one bit as in the family.
int tag_width_bits(const apriltag_family_t& family, int border_bits);

/// Returns true if bit `bit` (below family.nbits) of the tag `id` is white.
bool is_tag_bit_white(const apriltag_family_t& family, int id, uint32_t bit);

/// Returns true if the image shows the bits of the tag's id between the corners of `tag`. Bits are
/// sampled at their centers. A bit is white above the middle between the mean samples of white and
/// of black bits: white that grows by blur or overexposure makes single black bits gray. Up to two
/// bits may differ. Returns false if a bit lies outside the image.
///
/// @param levels       gray levels of the image
/// @param border_bits  width of the printed border, in bits
bool has_tag_bits(const TagDetection& tag, const cv::Mat1b& levels, const apriltag_family_t& family,
                  int border_bits);

/// Printed pattern next to the edges of a board's tags, in bits.
class TagGeometry {
 public:
  /// Segment along a side; distances from the first corner of the side, in bits.
  struct Segment {
    double from, to;
  };
  /// Segments of each side, from corner k to k + 1 in the order of TagDetection.
  using Sides = std::array<std::vector<Segment>, 4>;

  /// Computes the geometry of the tags of a board.
  /// @throws std::invalid_argument if libapriltag does not have the family
  explicit TagGeometry(const Board& board);

  /// Width of a tag with its border, in bits.
  double width_bits() const { return width_; }
  /// Width of the uniform stripe along an edge, inside and outside the tag, in bits.
  double inner_stripe_bits() const { return inside_; }
  double outer_stripe_bits() const { return outside_; }
  /// Returns the segments in which white bits adjoin the black stripe inside the edge. Empty for
  /// families with a white border.
  Sides list_white_segments(int id) const;

 private:
  TagFamily family_;
  double width_, inside_, outside_;
};

/// Corners of the tags of a board that are nearest to a place on it.
struct NearestCorners {
  /// Corners of four tags at most, on the board in m and in the image.
  std::vector<PlanePair> pairs;
  /// Distance of the nearest tag, m; infinite without one.
  double distance_m;
};

/// Returns the corners of the detected tags with the smallest `distance_m` below `max_distance_m`.
/// @pre `layout` has the ids of all tags
NearestCorners match_tag_corners(const std::vector<TagDetection>& tags,
                                 const std::vector<BoardTag>& layout, double max_distance_m,
                                 const std::function<double(const BoardTag&)>& distance_m);

}  // namespace vlp
