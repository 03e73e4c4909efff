// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "captures/detections_table.h"
#include "detection/detect_lights.h"
#include "lamps/signal/lamp_classifier.h"
#include "lamps/signal/period_groups.h"

namespace vlp {

/// The light that a label means: the nearest that flickers and is wholly in view, with the label
/// within half its radius. Nothing when there is none.
const Light* light_at(const ImageLights& image, const Eigen::Vector2d& pixel);

/// Lights with the lamps that a table says they are.
struct Labelled {
  std::vector<LabelledLight> lights;
  /// Labels of images that were used, and those of them without a light.
  int labels = 0, without_light = 0;
};

/// Adds the lights of one folder; `labels` has the names of its images.
void add_labelled(const std::vector<ImageLights>& images, const std::vector<Frame>& labels,
                  Labelled& labelled);

/// Measured period of a light, and the light's place.
struct LightPeriod : MeasuredPeriod {
  /// Index of the image.
  std::size_t image;
  Eigen::Vector2d pixel;
  double sigma_px;
};

/// Periods of the lights that are wholly in view and whose stripes are trustworthy(). With `labels`
/// only of lights that have one.
std::vector<LightPeriod> measured_periods(const std::vector<ImageLights>& images,
                                          const std::vector<Frame>& labels);

}  // namespace vlp
