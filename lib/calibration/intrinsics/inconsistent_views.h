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
  /// Indices of the views in the input of the solve, ascending.
  std::vector<std::size_t> views;
  /// Number of the other views.
  std::size_t others = 0;
  /// Median residual of a corner, in px: in the worst of the views, and in the typical view. The
  /// worst is infinite for a view that fits no pose.
  double worst_px = 0, typical_px = 0;
};

/// Finds views that do not fit the lens of the other views: those that fit no pose
/// (IntrinsicsSolution::dropped), unless it is a single one, and those with a median residual of
/// three times the typical view's or more, of which at least 10 % of the corners are outliers of
/// the solve. Returns no view if they are half of all or more: then it is unknown which views are
/// of one camera.
///
/// Reason for both conditions: a view of a bent board or of a shaken camera has large residuals
/// without outliers of the solve, and single tags that are misdetected are outliers of a view whose
/// median is typical. Rendered views of two cameras (focal lengths 0.8 to 2.3 % apart, 3 or 8 of
/// 36): medians of 3.3 or more, 18 % or more outliers; of one camera, rendered and real: 2.6 or
/// less, 8 % or less. Two cameras whose lenses differ by less than the residuals are not told
/// apart. Precondition: solution.ok().
InconsistentViews find_inconsistent_views(const IntrinsicsSolution& solution);

/// Describes the views in a line, with the images of the input of the solve: "3 board images do not
/// fit the other 33: 0005.png, ...". Precondition: there are some.
std::string describe(const InconsistentViews& found, const std::vector<std::string>& images);

}  // namespace vlp
