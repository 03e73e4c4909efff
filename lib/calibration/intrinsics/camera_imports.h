// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "calibration/intrinsics/valid_region.h"
#include "rig/calibration.h"

namespace vlp {

/// Camera from a file of any supported format.
struct ImportedCamera {
  Camera camera;
  /// Polygon of the image region where the lens is calibrated, px: region_px of a calibration, or
  /// valid_intrinsics_region of mrcal. Empty if the file has none.
  ImageRegion region;
};
/// Reads a camera. The format is detected from the content:
///   calibration of this toolbox
///   mrcal's .cameramodel, with a lens model of the toolbox
///   OpenCV's FileStorage (YAML): image_width, image_height, camera_matrix,
///     distortion_coefficients; distortion_model: fisheye for cv::fisheye
///   ROS camera_info: plumb_bob, rational_polynomial, equidistant
///   Kalibr's camchain, its cam0: pinhole with radtan, equidistant or none
/// @throws InputError, also for skewed camera matrices and for an empty valid_intrinsics_region
ImportedCamera read_any_camera(const std::filesystem::path& file);

/// Camera whose lens was replaced by one of another model.
struct FittedCamera {
  Camera camera;
  /// Largest distance between the pixels to which the two lenses project a ray, px; fraction of the
  /// image whose rays both lenses project.
  double worst_px, common_fraction;
};
/// Fits a lens of another model to the rays of a camera over the image, by least squares in pixels
/// (make_pixel_grid(); splined lenses: fit_splined_lens()). Returns a camera that
/// already has the model unchanged.
/// @throws std::invalid_argument if no lens of the model is close to the camera's; if a splined
///     model has too few control points in the field of view
FittedCamera convert_lens_model(const Camera& camera, LensModel model);

}  // namespace vlp
