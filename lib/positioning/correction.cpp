// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/correction.h"

#include <stdexcept>

#include "geometry/frames.h"

namespace vlp {
namespace {

/// Returns the shear that takes z to z - offset.
Eigen::Matrix3d make_shear_matrix(const Eigen::Vector2d& offset) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  matrix.topRightCorner<2, 1>() = -offset;
  return matrix;
}

}  // namespace

Eigen::Matrix3d compute_level_from_camera_matrix(const Calibration& calibration,
                                                 Correction correction) {
  const auto& rotation = calibration.rotation_center;
  const auto& dispersion = calibration.dispersion;
  if (correction == Correction::rotation && !rotation) {
    throw std::invalid_argument("the calibration has no rotation_center");
  }
  if (correction == Correction::dispersion && !dispersion) {
    throw std::invalid_argument("the calibration has no dispersion");
  }
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  const Eigen::Vector2d center_px = calibration.camera.principal_point_px();
  if (rotation && !(rotation->zenith_in_camera.allFinite() && rotation->center_px.allFinite() &&
                    rotation->zenith_in_camera.z() > 0)) {
    // [FILE-5]
    throw std::invalid_argument("the rotation_center is not finite or its zenith not in front");
  }
  if (dispersion && !dispersion->offset_px.allFinite()) {
    throw std::invalid_argument("the dispersion is not finite");
  }
  const bool tilts = rotation && rotation->model == RotationModel::tilt;
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  if (rotation && (correction == Correction::rotation || correction == Correction::all)) {
    matrix = tilts ? level_rotation_from_zenith(rotation->zenith_in_camera)
                   : make_shear_matrix((rotation->center_px - center_px).cwiseQuotient(focal_px));
  }
  if (dispersion && (correction == Correction::dispersion || correction == Correction::all)) {
    const Eigen::Vector2d offset = dispersion->offset_px.cwiseQuotient(focal_px);
    matrix = (tilts ? level_rotation_from_zenith({offset.x(), offset.y(), 1})
                    : make_shear_matrix(offset)) *
             matrix;
  }
  return matrix;
}

}  // namespace vlp
