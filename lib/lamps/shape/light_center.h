// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "lamps/image/background.h"
#include "lamps/shape/light.h"
#include "rig/calibration.h"

namespace vlp {

/// Camera parameters that a light detector uses. Lights are also detected without a row time (with
/// up to 24 dark rows between stripes), but identified then only with a classifier.
struct DetectorCamera {
  Readout readout;
  std::optional<double> row_time_s;
  /// Lens of the camera; std::nullopt: ellipses are fitted in the distorted image.
  std::optional<Lens> lens;
  /// Rotation from the camera frame to the level frame; identity if the tilt is not calibrated.
  Eigen::Matrix3d level_from_camera = Eigen::Matrix3d::Identity();
};

/// Plane in which the outlines of lights are fitted: the level plane at height 1, seen through the
/// lens, in which discs are circles; without a lens the image. Reason: the center of an outline in
/// the image is not the image of the center (lib/THEORY.md, "Lamp centroid").
class LightShape {
 public:
  explicit LightShape(const DetectorCamera& camera) : camera_(camera) {}

  /// Sets center, outline, bounding box and radius of a light. Returns false, and changes nothing,
  /// if the lens does not cover its rim.
  bool set_outline(const PlaneEllipse& outline, double radius_px, MeasuredLight& light) const;

  /// Corrects center and sigma_px of a light for camera motion. @pre light.outline_equations has a
  /// value.
  ///
  /// @param oval             prior of the ovality, relative to the fitted outline, in radii
  /// @param motion_per_line  motion of the light in the level plane per scanline
  void correct_center_for_motion(const Oval& oval, const Eigen::Vector2d& motion_per_line,
                                 MeasuredLight& light) const;

  /// Converts (u, v) of the image to (column, line), and back.
  Eigen::Vector2d swap_axes(const Eigen::Vector2d& at) const;
  std::vector<Eigen::Vector2d> swap_axes(std::vector<Eigen::Vector2d> points) const;

  bool has_known_lens() const { return camera_.lens.has_value(); }
  bool is_camera_tilted() const { return !camera_.level_from_camera.isIdentity(0); }
  /// Converts (u, v) to a point of the level plane at height 1, and back. Without a lens both are
  /// equal. Return std::nullopt if the lens or the plane does not cover the point.
  std::optional<Eigen::Vector2d> plane_from_pixel(const Eigen::Vector2d& pixel) const;
  std::optional<Eigen::Vector2d> pixel_from_plane(const Eigen::Vector2d& plane) const;

  /// Returns the derivative of the scanline at which a point near the circle is read with respect
  /// to its x, y.
  Eigen::Vector2d compute_scanline_gradient(const Circle& circle) const;

 private:
  /// Returns the center error of a circle's outline that lens distortion of the scanlines causes:
  /// on average the outline is read later, or earlier, than the center. The outline in direction a
  /// is displaced by m (l(a) - l). m is the motion per scanline, l(a) the scanline of the outline,
  /// and l that of the center. The error is the component along a that varies as cos a and sin a.
  /// Partly visible outlines are treated as complete ones.
  Eigen::Vector2d compute_curved_line_offset(const Circle& circle,
                                             const Eigen::Vector2d& motion_per_line) const;

  DetectorCamera camera_;
};

}  // namespace vlp
