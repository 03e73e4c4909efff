// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "captures/detections_table.h"
#include "frontend/observation.h"
#include "lamps/signal/lamp_classifier.h"
#include "lamps/signal/row_time.h"

namespace vlp {

/// Finds the light at the pixel (u, v) of a label. It is the nearest modulated light that is
/// completely in view and whose center is within half its radius of `pixel`. Returns nullptr if
/// there is none.
const Light* find_light(const Observation& image, const Eigen::Vector2d& pixel);

/// Lights to which a table of labels assigns a lamp id, accumulated over folders by
/// add_labeled_lights(). Covers only images that are not rejected; lights without a label are
/// omitted. Also counts the labels.
struct LabeledLights {
  std::vector<LabeledLight> lights;
  /// Number of labels in images that are used, and number of these labels without a light.
  int num_labels = 0, num_labels_without_light = 0;
};

/// Adds the lights of one folder; `labels` refers to its images by name.
void add_labeled_lights(std::span<const Observation> images, const std::vector<Frame>& labels,
                        LabeledLights& labeled);

/// Measured stripe period of a light, with its image and position.
struct LightPeriod : MeasuredPeriod {
  /// Index of the image in the input of collect_periods().
  std::size_t image;
  Eigen::Vector2d pixel;
  double sigma_px;
};

/// Returns the periods of the modulated lights whose stripes are reliable (are_stripes_reliable()),
/// also of lights that the image border cuts. If `labels` is not empty, only of labeled lights.
std::vector<LightPeriod> collect_periods(std::span<const Observation> images,
                                         const std::vector<Frame>& labels);

}  // namespace vlp
