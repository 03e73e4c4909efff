// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <algorithm>
#include <ranges>
#include <utility>

#include "captures/digest.h"
#include "geometry/median.h"
#include "rig/input_error.h"

namespace vlp {

UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe) {
  UnitImage image;
  try {
    image.sha256 = sha256_of_file(file);
    image.seen = observe(SourceImage(file));
  } catch (const InputError&) {
    image.seen = {file};
    image.seen.reject(RejectionReason::unreadable, "cannot be read as an image");
  }
  return image;
}

int UnitStep::used() const {
  return static_cast<int>(std::ranges::count_if(std::views::values(images), &UnitImage::is_used));
}

Observations collect_observations(const UnitStep& step) {
  Observations seen;
  for (const auto& [name, image] : step.images) seen.images.push_back(image.seen);
  return seen;
}

std::vector<Frame> collect_frames(const UnitStep& step) {
  std::vector<Frame> frames;
  for (const UnitImage* image : used_images(step)) {
    frames.push_back({image->seen.name(), collect_lamps(image->seen)});
  }
  return frames;
}

std::vector<const UnitImage*> used_images(const UnitStep& step) {
  std::vector<const UnitImage*> used;
  for (const auto& [name, image] : step.images) {
    if (image.is_used()) used.push_back(&image);
  }
  return used;
}

ImageCoverage board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px) {
  ImageCoverage coverage(imager_px);
  for (const UnitImage* image : used_images(step)) {
    if (!image->seen.board) continue;
    for (const PointDetection& corner : collect_corners(image->seen.board->seen))
      coverage.add(corner.pixel);
  }
  return coverage;
}

std::optional<double> typical_blur_px(const UnitStep& boards) {
  std::vector<double> blurs_px;
  for (const auto& [name, image] : boards.images) {
    const bool counts = image.is_used() || !boards.sufficient;
    if (counts && image.seen.blur_px) blurs_px.push_back(*image.seen.blur_px);
  }
  if (blurs_px.empty()) return std::nullopt;
  return upper_median(std::move(blurs_px));
}

StepPlot render_async(std::function<Drawing()> drawing) {
  const auto draw = [drawing = std::move(drawing)]() -> std::optional<ReportPlot> {
    try {
      return make_report_plot(drawing());
    } catch (const InputError&) {  // no gnuplot: a report without it is better than none
      return std::nullopt;
    }
  };
  return std::async(std::launch::async, draw).share();
}

}  // namespace vlp
