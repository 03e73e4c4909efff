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

/// With less points on it a circle or an ellipse is not beyond doubt.
inline constexpr std::size_t kLeastOutlinePoints = 10;

/// What a detector knows of the camera. The row time is needed for identities.
struct DetectorCamera {
  Readout readout;
  std::optional<double> row_time_s;
  /// Without it ellipses are fitted in the image itself.
  std::optional<Lens> lens;
  /// level_from_camera, for discs that a tilted camera sees.
  Eigen::Matrix3d level_from_camera = Eigen::Matrix3d::Identity();
  /// Ellipses are no lights that are longer than so many times their width: of a disc seen 60
  /// degrees off its axis.
  double most_slender = 2;
};

/// The shape of lights by their outline. Edge points go through the lens into the level plane; a
/// circle is fitted there robustly, and its centre is projected back, because the centre of an
/// outline in the image is not the image of the centre (lib/THEORY.md, "Lamp centroid"). Without a
/// lens an ellipse is fitted in the image.
class LightShape {
 public:
  explicit LightShape(const DetectorCamera& camera) : camera_(camera) {}

  /// The light with that outline, or most of it: everything but kind, lamp and stripes. Of a
  /// mottled light, see RefinedOutline, the sigma counts neighbouring points by how many err
  /// together. Nothing when it is not round, or its centre is not known to a pixel or so.
  std::optional<Light> light_of(std::vector<EdgePoint> outline, const Background& background,
                                bool mottled = false) const;

  /// Moves the centre to where it is with the outline as oval as that, of a light that moves so far
  /// of the level plane per line, and states its sigma_px.
  void shift(const Oval& oval, const Eigen::Vector2d& motion_per_line, Light& light) const;

  /// The points that lie outside a light.
  std::vector<EdgePoint> outside(const Light& light, const std::vector<EdgePoint>& outline) const;

  /// (column, row) of the lines that the shutter reads from (u, v) of the image, and back.
  Eigen::Vector2d turned(const Eigen::Vector2d& at) const;
  std::vector<Eigen::Vector2d> turned(std::vector<Eigen::Vector2d> points) const;

  bool has_lens() const { return camera_.lens.has_value(); }
  bool knows_level() const { return !camera_.level_from_camera.isIdentity(0); }
  /// The point of the level plane, at height 1, that is seen at (u, v), and back; without a lens
  /// that is the pixel itself.
  std::optional<Eigen::Vector2d> plane_of(const Eigen::Vector2d& pixel) const;
  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector2d& plane) const;

 private:
  /// By how many lines the shutter reads a point later than the centre, over its x, y.
  Eigen::Vector2d line_slope_at(const Circle& circle) const;

  /// How far the centre of a circle's outline is off because the lens bends the lines that it is
  /// read in, so that the outline is read later, or sooner, on the whole than the centre: in
  /// direction a by m (l(a) - l) with the motion m and the lines l, of which the circle's centre
  /// takes over the part along a that goes with cos a and sin a: of a whole outline, which parts
  /// are taken for, too.
  Eigen::Vector2d read_off(const Circle& circle, const Eigen::Vector2d& motion_per_line) const;

  DetectorCamera camera_;
};

}  // namespace vlp
