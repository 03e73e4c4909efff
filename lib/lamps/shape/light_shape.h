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

/// Minimum number of points on a circle or an ellipse.
inline constexpr std::size_t kMinOutlinePoints = 10;

/// Camera parameters of a detector. Identification needs the row time.
struct DetectorCamera {
  Readout readout;
  std::optional<double> row_time_s;
  /// Lens; without it ellipses are fitted in the image.
  std::optional<Lens> lens;
  /// Rotation of a tilted camera.
  Eigen::Matrix3d level_from_camera = Eigen::Matrix3d::Identity();
  /// Maximum ratio of the axes of an ellipse: that of a disc seen 60 degrees off its axis.
  double max_axis_ratio = 2;
};

/// The shape of lights by their outline. Edge points go through the lens into the level plane; a
/// circle is fitted there robustly, and its centre is projected back, because the centre of an
/// outline in the image is not the image of the centre (lib/THEORY.md, "Lamp centroid"). Without a
/// lens an ellipse is fitted in the image.
class LightShape {
 public:
  explicit LightShape(const DetectorCamera& camera) : camera_(camera) {}

  /// Fits a light to an outline, or to most of it: all members but kind, lamp and stripes. The
  /// sigma of a mottled light, see RefinedOutline, allows for the common error of neighbouring
  /// points. Returns std::nullopt if the outline is not round, or if its centre is not determined
  /// to about a pixel.
  std::optional<Light> light_of(std::vector<EdgePoint> outline, const Background& background,
                                bool mottled = false) const;

  /// Corrects the centre and sigma_px of a light for the oval of its outline and its motion in the
  /// level plane per line.
  void shift(const Oval& oval, const Eigen::Vector2d& motion_per_line, Light& light) const;

  /// Returns the points outside a light.
  std::vector<EdgePoint> outside(const Light& light, const std::vector<EdgePoint>& outline) const;

  /// Converts (u, v) of the image to (column, line) and back.
  Eigen::Vector2d turned(const Eigen::Vector2d& at) const;
  std::vector<Eigen::Vector2d> turned(std::vector<Eigen::Vector2d> points) const;

  bool has_lens() const { return camera_.lens.has_value(); }
  bool knows_level() const { return !camera_.level_from_camera.isIdentity(0); }
  /// Converts (u, v) to a point of the level plane at height 1, and back. Without a lens both are
  /// equal.
  std::optional<Eigen::Vector2d> plane_of(const Eigen::Vector2d& pixel) const;
  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector2d& plane) const;

 private:
  /// Returns the derivative of the line in which a point is read by its x, y.
  Eigen::Vector2d line_slope_at(const Circle& circle) const;

  /// Returns the error of the centre of a circle's outline because the lens bends the lines that it
  /// is read in: on the whole the outline is read later, or sooner, than the centre. In direction a
  /// it is displaced by m (l(a) - l), with the motion m and the lines l; the error is the part
  /// along a that varies as cos a and sin a. Parts of an outline are treated as whole ones.
  Eigen::Vector2d read_off(const Circle& circle, const Eigen::Vector2d& motion_per_line) const;

  DetectorCamera camera_;
};

}  // namespace vlp
