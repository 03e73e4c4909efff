// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <algorithm>
#include <utility>

#include "captures/digest.h"
#include "geometry/median.h"
#include "rig/input_error.h"

namespace vlp {

UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe) {
  UnitImage image;
  try {
    image.sha256 = compute_file_sha256(file);
    image.seen = observe(SourceImage(file));
  } catch (const InputError&) {
    image.seen = {file};
    image.seen.set_rejection(RejectionReason::unreadable, "cannot be read as an image");
  }
  return image;
}

int UnitStep::count_used_images() const {
  return static_cast<int>(
      std::ranges::count_if(images, [](const auto& entry) { return entry.second.is_used(); }));
}

Observations collect_observations(const UnitStep& step) {
  Observations seen;
  for (const auto& [name, image] : step.images) seen.images.push_back(image.seen);
  return seen;
}

std::vector<Frame> collect_frames(const UnitStep& step) {
  std::vector<Frame> frames;
  for (const UnitImage* image : list_used_images(step)) {
    frames.push_back({image->seen.file_name(), collect_identified_lamps(image->seen)});
  }
  return frames;
}

std::vector<const UnitImage*> list_used_images(const UnitStep& step) {
  std::vector<const UnitImage*> used;
  for (const auto& [name, image] : step.images) {
    if (image.is_used()) used.push_back(&image);
  }
  return used;
}

ImageCoverage compute_board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px) {
  ImageCoverage coverage(imager_px);
  for (const UnitImage* image : list_used_images(step)) {
    if (!image->seen.board) continue;
    for (const PointDetection& corner : collect_detected_corners(image->seen.board->seen))
      coverage.add(corner.pixel);
  }
  return coverage;
}

std::optional<double> compute_median_blur_px(const UnitStep& boards) {
  std::vector<double> blurs_px;
  for (const auto& [name, image] : boards.images) {
    const bool counts = image.is_used() || !boards.sufficient;
    if (counts && image.seen.blur_px) blurs_px.push_back(*image.seen.blur_px);
  }
  if (blurs_px.empty()) return std::nullopt;
  return upper_median(std::move(blurs_px));
}

StepPlot render_plot_async(std::function<Drawing()> drawing) {
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
