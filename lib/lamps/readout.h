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

/// Evidence for each readout direction of a camera, summed over images.
struct ReadoutDirectionEvidence {
  /// Evidence that the shutter reads rows, and that it reads columns; dimensionless, larger is
  /// stronger. Each is the sum, over the modulated lights detected with this direction, of
  /// periodicity times contrast times Light::inlier_fraction. These factors are 0 to 1.
  double rows = 0, columns = 0;

  /// Returns the readout direction with the larger evidence. Returns std::nullopt if this evidence
  /// is below 1, that of one perfect light, or below three times that of the other direction.
  std::optional<Readout> readout_direction() const;
};

/// Returns the sum of ReadoutDirectionEvidence over `lights`, which were detected with one readout
/// direction.
double sum_readout_evidence(std::span<const Light> lights);

/// Adds the evidence of a whole image. With the correct readout direction a lamp has stripes; with
/// the other one it breaks into pieces or has no stripes.
void add_readout_evidence(const ImageView& image, ReadoutDirectionEvidence& evidence);

/// Estimates the readout direction from images in their order, from at most eight images with
/// modulated lights. Stops when the evidence is clear. Returns std::nullopt if it is not.
///
/// @param images  number of images
/// @param image   returns an image by index, valid until the next call; empty if the image is
///        unusable
std::optional<Readout> estimate_readout(std::size_t images,
                                        const std::function<ImageView(std::size_t)>& image);

/// Lights of an image and the readout direction with which they were detected.
struct LightsWithReadout {
  Readout readout;
  std::vector<Light> lights;
};

/// Detects the lights of an image with unknown readout direction. Uses the detector's direction, or
/// the other one if the image has clear evidence for it, for example if a phone rotated the image.
LightsWithReadout detect_both_readouts(const LightDetector& detector, const ImageView& image);

}  // namespace vlp
