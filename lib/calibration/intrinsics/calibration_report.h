// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/known_region.h"
#include "calibration/intrinsics/projection_difference.h"
#include "rig/calibration.h"

namespace vlp {

/// How far a solution can be trusted.
struct CalibrationReport {
  /// Where the lens is known, and its share of the image.
  ImageRegion region;
  double region_share;
  /// ProjectionUncertainty::worst_px(), by tags, over the pixel_grid() of the region: the mean and
  /// the worst; and the worst beyond. The worst is no less than what the largest error
  /// over the region is expected to be, expected_worst_px(), by tags, by independent corners and by
  /// views; but of a splined lens. Where another model fits as well, solve_lens() makes it what
  /// lies between the two.
  double uncertainty_mean_px, uncertainty_worst_px;
  double uncertainty_beyond_px;
  /// Standard deviation of fx: by the noise of the tags, and by covariance_by_views().
  double focal_sd_px, focal_sd_by_views_px;
  /// What the lens should be apart from the true one, as projection_difference() says it, rms per
  /// axis: by the noise, and by covariance_by_views(). Of a splined lens over the region.
  double expected_rms_px, expected_by_views_rms_px;
  /// Between the lens of every other view and that of the rest (solve_every_other()): twice
  /// expected_rms_px when the lens model fits and the tags' errors are independent; more when
  /// they are not. Of a splined lens where both halves have corners. Nothing when a half does not
  /// determine a lens.
  std::optional<ProjectionDifference> halves;
};
/// Precondition: solution.ok(). Two more solves.
CalibrationReport report_on(const IntrinsicsSolution& solution, const IntrinsicsInput& input);

/// What a solution leaves of each of some views that took no part in it, rms per axis: their poses
/// and the shifts of their edges are fitted, nothing else. All corners count as they are given, so
/// that lens models can be compared by it. Infinite of a view without a pose.
std::vector<double> held_out_rms_px(const IntrinsicsSolution& solution,
                                    const IntrinsicsInput& held_out);

/// The same of all of them together.
struct HeldOut {
  int views = 0, corners = 0;
  /// Per axis.
  double rms_px = 0;
};
/// Views without a pose are left out.
HeldOut held_out_fit(const IntrinsicsSolution& solution, const IntrinsicsInput& held_out);

/// Where the views have corners, and how they tilt.
struct ViewCoverage {
  /// Corners in each of 3 x 3 parts of the image, row by row from the top left.
  std::array<int, 9> corners{};
  /// Share of 8 x 6 parts of the image that have corners.
  double share = 0;
  /// The largest angle, over the views, by which the board's left, right, upper and lower side (as
  /// the image shows it) is nearer to the camera.
  std::array<double, 4> tilts_rad{};
  /// The largest angle between two of the boards.
  double tilt_rad = 0;
};
ViewCoverage coverage_of(const IntrinsicsSolution& solution, const IntrinsicsInput& input);

/// One line: where in the image to show the board, and how to tilt it, next; the place with the
/// fewest corners and the side that was tilted least.
std::string next_view(const ViewCoverage& coverage);

}  // namespace vlp
