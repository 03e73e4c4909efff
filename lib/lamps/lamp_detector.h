// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "../rig/calibration.h"
#include "../rig/detection.h"
#include "../rig/lamp_map.h"
#include "image/image_view.h"

namespace vlp {

class LightDetector;  // light_detector.h: reports all lights with their measurements

/// Detects and identifies the lamps of a map in images of a rolling-shutter camera, for
/// Positioner::compute_position_fix(). Immutable: any number of threads may share the detector and
/// its copies.
///
/// The center of a lamp is estimated from its outline, a disc or a rectangle, and projected through
/// the lens. A lamp is identified by its frequency f, which makes stripes with a period of 1 / (f
/// row_time) scanlines. Equations and sources: lib/THEORY.md, "Lamp centroid".
class LampDetector {
 public:
  /// Creates a detector of the lamps of a map for one camera. Lens, tilt, row time and readout
  /// direction are those of the calibration. Copies what it needs.
  /// @throws std::invalid_argument if the calibration has no row time, which identification needs,
  ///     or has an invalid lens
  LampDetector(const LampMap& lamps, const Calibration& calibration);

  /// Detects the lamps that are fully inside the image, ordered from the top. Lamps that the image
  /// border cuts and lights that are not identified are excluded. Allocates memory on the heap.
  ///
  /// @param image  unmodified camera image of 8 or 16 bits, of the size of the calibration's images
  /// @return       pixel (u, v) of the centers and their standard deviation per axis, in pixels
  /// @throws std::invalid_argument if `image` has no pixels, another size, another bit depth, rows
  ///        that overlap, or 16-bit pixels at odd addresses
  std::vector<Detection> detect_lamps(const ImageView& image) const;
  /// The same for a camera with another tilt, of which lamps are discs in the plane that is level
  /// by the rotation level_from_camera. std::nullopt: unknown, for which ellipses are fitted in the
  /// image.
  std::vector<Detection> detect_lamps(
      const ImageView& image, const std::optional<Eigen::Matrix3d>& level_from_camera) const;

 private:
  std::shared_ptr<const LightDetector> detector_;
  ImageSize size_;
};

}  // namespace vlp
