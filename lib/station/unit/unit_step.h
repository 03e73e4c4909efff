// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/image_coverage.h"
#include "captures/detections_table.h"
#include "session/step_result.h"
#include "station/unit/step_picture.h"
#include "station/unit/unit_image.h"

namespace vlp {

/// State of one step of a unit.
struct UnitStep {
  /// Folder of captures.csv and truth.csv.
  std::filesystem::path folder = {};
  /// Images, by name.
  std::map<std::string, UnitImage> images = {};
  /// Images that wait for the previous step.
  std::vector<std::filesystem::path> waiting = {};
  /// True if the images meet the station's completion criterion.
  bool sufficient = false;
  /// Result of the images, after the step is complete.
  std::optional<StepResult> result = {};
  /// Plot of the result, if it has one.
  StepPlot picture = {};
  /// Number of consecutive rejected images at the end.
  int num_consecutive_rejections = 0;
  /// Number of rejected images of an incomplete batch.
  int num_rejected_in_batch = 0;
  bool is_any_used_in_batch = false;
  /// Name of the last image.
  std::string last = {};

  bool done() const { return sufficient && result && result->ok(); }
  int used() const;
};

/// Returns the observations of the images, by name.
Observations collect_observations(const UnitStep& step);
/// Returns the frames of the images that are used, by name.
std::vector<Frame> collect_frames(const UnitStep& step);
/// Returns the images that are used, by name.
std::vector<const UnitImage*> used_images(const UnitStep& step);

/// Counts the corners of the used views in the cells of the image.
ImageCoverage board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px);

/// Returns the median blur of the used views, once the step is complete. Before that it includes
/// rejected views, because all views of a blurred lens are rejected.
std::optional<double> typical_blur_px(const UnitStep& boards);

}  // namespace vlp
