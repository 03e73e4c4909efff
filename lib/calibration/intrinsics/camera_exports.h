// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/intrinsics/known_region.h"
#include "rig/calibration.h"

namespace vlp {

/// A camera as others write it, in YAML. All of them have pixel centres at whole numbers, as here.
/// Each throws std::invalid_argument for a lens model that the format does not have.

/// ROS camera_info: plumb_bob for PINHOLE, OPENCV4 and OPENCV5, rational_polynomial for OPENCV8,
/// equidistant for OPENCV_FISHEYE.
std::string ros_camera_info(const Camera& camera);
/// Kalibr's camchain: pinhole with radtan, for PINHOLE and OPENCV4, or with equidistant, for
/// OPENCV_FISHEYE.
std::string kalibr_camchain(const Camera& camera);
/// OpenCV's FileStorage: camera_matrix and distortion_coefficients, for all but STEREOGRAPHIC and
/// splined lenses.
/// Those of OPENCV_FISHEYE are for cv::fisheye; distortion_model says so.
std::string opencv_camera(const Camera& camera);
/// mrcal's .cameramodel, the camera and, unless it is empty, where its lens is known; for all but
/// OPENCV_FISHEYE.
std::string mrcal_cameramodel(const Camera& camera, const ImageRegion& region = {});
/// That region's key and value in a .cameramodel, a line; "" when it is empty.
std::string mrcal_region(const ImageRegion& region);

}  // namespace vlp
