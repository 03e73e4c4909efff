// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/valid_region.h"
#include "rig/calibration.h"

namespace vlp {

/// Uncertainty of the lens of a solution, over the image.
struct CalibrationReport {
  /// Region of the image where the lens is calibrated (make_valid_region()): polygon, px.
  /// In estimate_lens() each model that may describe the lens has rays there. `region_fraction` is
  /// its area as a fraction of the image, 0 to 1.
  ImageRegion region;
  double region_fraction;
  /// Mean and maximum of ProjectionUncertainty::worst_direction_sd_px() by tags,
  /// px, over the make_pixel_grid() of the region.
  ///
  /// The maximum is at least predict_max_difference_px() over the region for
  /// each of three covariances: by tags, by independent corners and by views. Splined lenses are
  /// excluded from this rule. estimate_lens() adds the uncertainty of the lens model and of the
  /// print.
  double uncertainty_mean_px, uncertainty_worst_px;
  /// Maximum of ProjectionUncertainty::worst_direction_sd_px() outside the region,
  /// px.
  double uncertainty_beyond_px;
  /// Standard deviation of fx, px: from the noise of the tags, and from
  /// jackknife_covariance().
  double focal_sd_px, focal_sd_by_views_px;
  /// Expected compare_projections() from the true lens, RMS per axis, px: from the noise
  /// of the tags, and from jackknife_covariance(). For splined lenses over
  /// the region only.
  double expected_rms_px, expected_by_views_rms_px;
  /// Difference over the region between the lens of every second view and that of the other views
  /// (solve_half_of_views()). It is about twice expected_rms_px if the lens model
  /// fits and the errors of tags are independent, and larger otherwise. For splined lenses only
  /// pixels that both halves determine are compared. std::nullopt if a half does not determine a
  /// lens.
  std::optional<ProjectionDifference> split_half_difference;
};
/// Computes the report of a solution; solves twice for `halves`. `input`: input of its solve.
/// @pre solution.has_succeeded()
CalibrationReport make_lens_report(const IntrinsicsSolution& solution,
                                   const IntrinsicsInput& input);
/// Computes the report with known uncertainties of the solution, over a given region.
CalibrationReport make_lens_report(const IntrinsicsSolution& solution, const IntrinsicsInput& input,
                                   const ProjectionUncertainty::ByCornersAndByTags& uncertainties,
                                   ImageRegion region);

/// Returns the RMS residual of each held-out view, per axis, px; infinity for a view without a
/// pose.
///
/// Lens and board warp are those of the solution. Edges get the curvature of the lens
/// (correct_curvature()); pose and edge shifts of each view are fitted. All
/// corners keep their given weights, so that lens models can be compared.
std::vector<double> compute_held_out_rms_px(const IntrinsicsSolution& solution,
                                            const IntrinsicsInput& held_out);

/// Residuals of all held-out views together, for the lens of the other views.
struct HeldOutFit {
  int views = 0, corners = 0;
  /// RMS residual per axis, px.
  double rms_px = 0;
};
/// Computes the fit of the held-out views as compute_held_out_rms_px(), without views
/// that have no pose.
HeldOutFit fit_held_out_views(const IntrinsicsSolution& solution, const IntrinsicsInput& held_out);

/// Distribution of the corners over the image, and tilts of the boards.
struct ViewCoverage {
  /// Number of corners in each of 3 x 3 parts of the image, row by row from the top left.
  std::array<int, 9> corners{};
  /// Fraction of 8 x 6 parts of the image that contain corners.
  double covered_fraction = 0;
  /// Largest angle over the views, rad, by which a side of the board is nearer to the camera. Order
  /// of the sides, as in the image: left, right, upper, lower.
  std::array<double, 4> tilts_rad{};
  /// Largest angle between the boards of two views, rad.
  double tilt_rad = 0;
};
/// Computes the coverage of the views in a solution. `input`: input of its solve.
ViewCoverage measure_view_coverage(const IntrinsicsSolution& solution,
                                   const IntrinsicsInput& input);

/// Recommends the next view in one line: the board in the part of the image with the fewest
/// corners, tilted towards the side that was tilted least.
std::string recommend_next_view(const ViewCoverage& coverage);

}  // namespace vlp
