// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "../rig/calibration.h"
#include "../rig/detection.h"
#include "../rig/lamp_map.h"
#include "image/image_view.h"

namespace vlp {

class LightDetector;  // light_detector.h: all lights with what was measured of them

/// Detects and identifies the lamps of a map in images of a rolling-shutter camera, for
/// Positioner::locate(). Immutable: any number of threads may share it, and its copies.
///
/// The centre is that of the disc or rectangle whose outline is seen, projected through the lens;
/// the identity is the lamp whose frequency f makes stripes of 1 / (f row_time) lines. Equations
/// and sources: lib/THEORY.md, "Lamp centroid".
class LampDetector {
 public:
  /// @throws std::invalid_argument if the calibration has no row time, by which lamps are told
  ///         apart, or a lens that is not one
  LampDetector(const LampMap& lamps, const Calibration& calibration);

  /// Detects the lamps that are wholly in an image, from the top. Those of which the image's edge
  /// cuts a part, and lights that are no lamp of the map, are left out. Takes memory from the heap.
  ///
  /// @param image  as the camera took it, of 8 or 16 bits, of the size of the calibration's images
  /// @return       pixel (u, v) of the centres and their standard deviation per axis in pixels
  /// @throws std::invalid_argument if `image` has no pixels, another size, other bits, rows that
  ///         overlap, or pixels of 16 bits at odd addresses
  std::vector<Detection> detect(const ImageView& image) const;

 private:
  std::shared_ptr<const LightDetector> detector_;
  ImageSize size_;
};

}  // namespace vlp
