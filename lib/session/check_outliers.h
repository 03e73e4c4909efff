// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// Smaller horizontal errors at known points are no fault of the captures: a camera may have them.
inline constexpr double kMinOutlierError_m = 0.005;

/// Error of one capture. `size` is the horizontal error of its fix at a known point, m, or the RMS
/// residual of its lamps in the image, px. The function that takes it determines which.
struct CaptureError {
  std::string image;
  double size;
  /// Index of the capture in the folder, which may have captures without an error.
  std::size_t capture = 0;
};

/// Describes captures that were taken elsewhere than their table says, or by another camera, in one
/// line: their errors are gross outliers of the others, more than 5 mm and 8 times the median.
/// Returns an empty string if there are none, and for fewer than five errors. Outliers are fewer
/// than half, because the median is typical of the others.
std::string describe_error_outliers(const std::vector<CaptureError>& errors_m);

/// Describes captures whose lamps do not fit the lens and tilt of the others, in one line: two
/// captures or more have residuals above 0.2 px and 8 times the median. A single one may show a
/// covered lamp or a reflection. Returns an empty string if there are none, for fewer than five
/// residuals, and if they are half of the captures or more.
std::string describe_residual_outliers(const std::vector<CaptureError>& residuals_px);

}  // namespace vlp
