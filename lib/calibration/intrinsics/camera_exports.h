// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/intrinsics/valid_region.h"
#include "rig/calibration.h"

namespace vlp {

// Cameras in the formats of other programs. As in this toolbox, the centers of pixels have integer
// coordinates in all of them. Each function throws std::invalid_argument if the format has no such
// lens model.

/// Formats ROS camera_info: plumb_bob for PINHOLE, OPENCV4 and OPENCV5, rational_polynomial for
/// OPENCV8, equidistant for OPENCV_FISHEYE. Throws std::invalid_argument also if the name of the
/// camera has control characters or is not UTF-8.
std::string format_ros(const Camera& camera);
/// Returns the camera as the text of a camchain.yaml of Kalibr: model pinhole, with distortion
/// radtan for PINHOLE and OPENCV4, and equidistant for OPENCV_FISHEYE.
/// @throws std::invalid_argument for other lens models
std::string format_camchain(const Camera& camera);
/// Formats OpenCV's FileStorage with camera_matrix and distortion_coefficients, for all models but
/// STEREOGRAPHIC and splined lenses. The coefficients of OPENCV_FISHEYE are those of cv::fisheye,
/// with "distortion_model: fisheye".
std::string format_opencv(const Camera& camera);
/// Formats mrcal's .cameramodel, a Python literal, for all models but OPENCV_FISHEYE. `region`:
/// valid_intrinsics_region, left out if empty.
std::string format_cameramodel(const Camera& camera, const ImageRegion& region = {});
/// Formats the line valid_intrinsics_region of a .cameramodel; "" if the region is empty.
std::string format_mrcal_region(const ImageRegion& region);

}  // namespace vlp
