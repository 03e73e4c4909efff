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

/// One step of a unit.
struct UnitStep {
  /// Where captures.csv and truth.csv are looked for.
  std::filesystem::path folder = {};
  /// By name.
  std::map<std::string, UnitImage> images = {};
  /// Images that wait for the step before.
  std::vector<std::filesystem::path> waiting = {};
  /// There are as many as the station wants.
  bool enough = false;
  /// What the images come to, once there are enough of them.
  std::optional<StepResult> result = {};
  /// Of the result, if it has one.
  StepPicture picture = {};
  /// Of the images refused one after another, the last ones.
  int refused_in_a_row = 0;
  /// Of the images that came together, of which more are to come.
  int refused_together = 0;
  bool used_together = false;
  /// The image that came last.
  std::string last = {};

  bool done() const { return enough && result && result->ok(); }
  int used() const;
};

/// Returns the observations of the images, by name.
Observations observations_of(const UnitStep& step);
/// Returns the frames of the images that are used, by name.
std::vector<Frame> frames_of(const UnitStep& step);
/// Returns the images that are used, by name.
std::vector<const UnitImage*> used_images(const UnitStep& step);

/// Counts the corners of the views that are used in the parts of the image.
ImageCoverage board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px);

/// Returns the median blur of the views that are used, once there are enough; before, that of all
/// views, rejected ones too, because a blurred lens has no others.
std::optional<double> typical_blur_px(const UnitStep& boards);

}  // namespace vlp
