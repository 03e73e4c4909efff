// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "calibration/intrinsics/known_region.h"
#include "rig/calibration.h"

namespace vlp {

struct AnyCamera {
  Camera camera;
  /// Where its lens is known, which calibrations (region_px) and mrcal (valid_intrinsics_region)
  /// tell; empty where nothing is said.
  ImageRegion region;
};
/// The camera in a file, whose content tells what it is:
///   a calibration of this toolbox
///   mrcal's .cameramodel, of the models that the toolbox has
///   OpenCV's FileStorage (YAML): image_width, image_height, camera_matrix,
///     distortion_coefficients; distortion_model: fisheye for cv::fisheye
///   ROS camera_info: plumb_bob, rational_polynomial, equidistant
///   Kalibr's camchain, its cam0: pinhole with radtan, equidistant or none
/// Skewed camera matrices are refused, and lenses that are known nowhere. Throws InputError.
AnyCamera read_any_camera(const std::filesystem::path& file);

/// A camera with a lens of another model, fitted to the pixels of the camera's rays all over the
/// image (pixel_grid(); of a splined lens splined_like()), by least squares.
struct FittedCamera {
  Camera camera;
  /// The largest distance between the two pixels of a ray, and the share of the image whose rays
  /// both have.
  double worst_px, share;
};
/// A camera that has the model already is given back as it is. Throws std::invalid_argument when
/// the model has no lens near the camera's, or a splined one too few control points where it sees.
FittedCamera with_lens_model(const Camera& camera, LensModel model);

}  // namespace vlp
