// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/light_detector.h"
#include "rig/calibration.h"

namespace vlp {

/// Evidence of images for one read-out and for the other.
struct ReadoutEvidence {
  /// Sum over the modulated lights with a read-out along rows, and along columns, of clarity times
  /// contrast times roundness, each from 0 to 1.
  double rows = 0, columns = 0;

  /// Returns the read-out with the larger evidence, if it is that of one light or more and three
  /// times the other.
  std::optional<Readout> readout() const;
};

/// Returns the sum of ReadoutEvidence over the lights that were detected with one read-out.
double readout_evidence(std::span<const Light> lights);

/// Adds the evidence of an image: with the right read-out a lamp has stripes, with the other one it
/// falls to pieces or has none.
void add_evidence(const ImageView& image, ReadoutEvidence& evidence);

/// Finds the read-out from the first images that show it, at most eight with lights. `image` gives
/// an image by number, which is used until the next call of it, or an empty one if it cannot be
/// used.
std::optional<Readout> find_readout(std::size_t images,
                                    const std::function<ImageView(std::size_t)>& image);

/// Lights of an image and the read-out with which they were detected.
struct LightsByReadout {
  Readout readout;
  std::vector<Light> lights;
};

/// Detects the lights of an image whose read-out is not known: with the detector's read-out, or
/// with the other one if the image has clear evidence for that, as when a phone turned it.
LightsByReadout detect_either_way(const LightDetector& detector, const ImageView& image);

}  // namespace vlp
