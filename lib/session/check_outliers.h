// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "evaluation/evaluation.h"
#include "positioning/fix.h"

namespace vlp {

/// Smaller horizontal errors at known points are no fault of the captures: a camera may have them.
inline constexpr double kMinOutlierError_m = 0.005;

/// Capture of a folder: its image, and its index among the captures used.
struct CaptureName {
  std::string image;
  std::size_t index = 0;
};

/// Horizontal error of the fix of a capture at a known point, m.
struct CaptureError {
  CaptureName capture;
  double error_m;
};

/// RMS residual of the lamps in the image of a capture, px.
struct CaptureResidual {
  CaptureName capture;
  double residual_px;
};

/// Describes captures that were taken elsewhere than their table says, or by another camera, in one
/// line: their errors are gross outliers of the others, more than `min_error_m` and 8 times the
/// median.
/// Returns an empty string if there are none, and for fewer than five errors. Outliers are fewer
/// than half, because the median is typical of the others.
std::string describe_error_outliers(const std::vector<CaptureError>& errors,
                                    double min_error_m = kMinOutlierError_m);

/// Describes a table of true positions in another order, or with x and y exchanged, or captures
/// that were not taken at their true positions (describe_error_outliers()). The latter are from
/// fixes of three lamps or more: others may have large errors at the edge of a room. Returns an
/// empty string if there are none.
std::string describe_wrong_positions(const EvaluationInput& input,
                                     double min_error_m = kMinOutlierError_m);

/// Common offset of all captures at known points.
struct CommonOffset {
  /// Fix minus known point: in the frame of the level camera if `in_camera`, otherwise in the
  /// world.
  Eigen::Vector2d offset_m;
  /// True if it rotates with the camera: the camera moved since it was calibrated. Otherwise the
  /// known points or the lamps moved.
  bool in_camera;
  /// Number of captures with a fix.
  std::size_t captures;
};

/// Finds an offset of more than 5 mm, without which the errors of captures at known points are a
/// third or less. Uses fixes of three lamps or more.
///
/// Returns std::nullopt if there is none, and for fewer than five fixes. Returns std::nullopt, too,
/// if the camera did not rotate between the captures, because the two frames cannot be separated
/// then.
std::optional<CommonOffset> find_common_offset(const EvaluationInput& input);

/// Describes an offset with its size and direction, and its possible reasons, in one line.
std::string describe_common_offset(const CommonOffset& offset);

/// Adds the RMS residual of a fix, as input of describe_residual_outliers(), if the fix is from
/// three lamps or more.
void add_residual(const Fix& fix, const std::string& image, std::size_t capture,
                  std::vector<CaptureResidual>& residuals);

/// Describes captures whose lamps do not fit the lens and tilt of the others, in one line: two
/// captures or more have residuals above 0.2 px and 8 times the median. A single one may show a
/// covered lamp or a reflection. Returns an empty string if there are none, for fewer than five
/// residuals, and if they are half of the captures or more.
std::string describe_residual_outliers(const std::vector<CaptureResidual>& residuals);

}  // namespace vlp
