// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Views that do not fit the lens of the other views, such as images of another camera.
struct InconsistentViews {
  /// Indices of the inconsistent views in IntrinsicsInput::views, ascending. Empty if all views
  /// fit.
  std::vector<std::size_t> views;
  /// Number of the other views, which fit.
  std::size_t num_other_views = 0;
  /// Median residual of a corner, px: in the worst of the views, and in the typical view. The worst
  /// is infinite for a view that fits no pose.
  double worst_px = 0, typical_px = 0;
};

/// Finds views that do not fit the lens of the other views:
/// - views that fit no pose (IntrinsicsSolution::dropped), unless only a single view is found
/// - views with a median residual of at least three times that of the typical view, if at least 10
///   % of their corners are outliers
///
/// Returns no view if half of all views or more are found: then the views of the camera cannot be
/// identified.
///
/// Reason for both conditions: a view of a bent board or of a shaken camera has large residuals
/// without outliers of the solve. Single misdetected tags are outliers in a view whose median is
/// typical.
///
/// Rendered views of two cameras (focal lengths 0.8 to 2.3 % apart, 3 or 8 of 36 views): medians of
/// at least 3.3, at least 18 % outliers. One camera, rendered and real: at most 2.6 and 8 %. Two
/// cameras whose lenses differ by less than the residuals cannot be distinguished.
/// @pre solution.has_succeeded()
InconsistentViews test_view_consistency(const IntrinsicsSolution& solution);

/// Describes the views in one line: "3 board images do not fit the other 33: 0005.png, ...".
/// `images`: images of the input of the solve.
/// @pre found.views is not empty
std::string describe_bad_views(const InconsistentViews& found,
                               const std::vector<std::string>& images);

}  // namespace vlp
