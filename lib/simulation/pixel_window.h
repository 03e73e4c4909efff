// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "simulation/pixel_rays.h"
#include "simulation/shot.h"

namespace vlp {

/// Window of lines and places, each from begin to before end. It may extend into the margin.
struct PixelWindow {
  int line_begin, line_end, place_begin, place_end;

  bool is_empty_window() const { return line_begin >= line_end || place_begin >= place_end; }
  cv::Mat1f make_constant_image(float value) const {
    return cv::Mat1f(line_end - line_begin, place_end - place_begin, value);
  }
  /// Returns the part of `image` inside this window; it shares the pixels. `image` covers the whole
  /// image of the camera with a margin of margin_px on each side
  /// (PixelRays::make_padded_image()).
  cv::Mat1f crop(const cv::Mat1f& image, int margin_px) const {
    return image(cv::Rect(place_begin + margin_px, line_begin + margin_px, place_end - place_begin,
                          line_end - line_begin));
  }
};

/// Returns the window of the image and its margin.
PixelWindow make_full_window(const PixelRays& rays);

/// Returns the window in which an object appears during the given part of the exposure while the
/// camera moves, blur included. Returns the whole window if the lens does not describe the whole
/// outline.
///
/// @param outline_m  neighboring points on the outline, in the world, m
PixelWindow compute_moving_window(const std::vector<Eigen::Vector3d>& outline_m,
                                  const BaseMotion& motion, const Shutter& shutter,
                                  const PixelRays& rays);

/// Returns the pixels that are in both windows.
PixelWindow intersect_windows(const PixelWindow& a, const PixelWindow& b);

/// Returns the box around a glow.
Panel make_bounding_panel(const Glow& glow);

/// Returns points around the light of a glow (its rim, or the end of its halo), or along the edges
/// of a panel.
std::vector<Eigen::Vector3d> list_outline_points(const Glow& glow);
std::vector<Eigen::Vector3d> list_outline_points(const Panel& panel);

/// Pose of a rendered target in the camera frame at a time relative to that of the capture.
using CameraFromTarget = std::function<Eigen::Isometry3d(double time_s)>;

/// Returns the longest path of one of the points in the image during an exposure, px, approximated
/// by 16 segments. Segments away from the image do not count.
///
/// @param points_m  points in the target's frame
double compute_max_motion_px(const std::vector<Eigen::Vector3d>& points_m,
                             const CameraFromTarget& camera_from_target, double exposure_s,
                             const PixelRays& rays);

/// Returns the number of parts into which an exposure is divided so that the image moves by at most
/// 0.1 px in each; at most 1000.
/// @param motion_px  motion of the image during the exposure (compute_max_motion_px())
int count_time_samples(double motion_px);

}  // namespace vlp
