// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "calibration/rotation/rotation_model.h"
#include "captures/digest.h"
#include "geometry/median.h"
#include "positioning/positioner.h"
#include "rig/input_error.h"

namespace vlp {

UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe) {
  UnitImage image;
  try {
    image.sha256 = hash_file(file);
    image.observation = observe(SourceImage(file));
  } catch (const InputError&) {
    image.observation = {file};
    image.observation.reject(RejectionReason::unreadable, "cannot be read as an image");
  }
  return image;
}

int UnitStep::count_used_images() const {
  return static_cast<int>(std::ranges::count_if(
      images, [](const auto& entry) { return entry.second.is_image_used(); }));
}

Observations list_observations(const UnitStep& step) {
  Observations seen;
  for (const auto& [name, image] : step.images) seen.images.push_back(image.observation);
  return seen;
}

std::vector<Frame> list_used_detections(const UnitStep& step) {
  std::vector<Frame> frames;
  for (const UnitImage* image : list_used_images(step)) {
    frames.push_back(
        {image->observation.image_file_name(), list_identified_lamps(image->observation)});
  }
  return frames;
}

std::vector<const UnitImage*> list_used_images(const UnitStep& step) {
  std::vector<const UnitImage*> used;
  for (const auto& [name, image] : step.images) {
    if (image.is_image_used()) used.push_back(&image);
  }
  return used;
}

ImageCoverage compute_board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px) {
  ImageCoverage coverage(imager_px);
  for (const UnitImage* image : list_used_images(step)) {
    if (!image->observation.board) continue;
    for (const PointDetection& corner :
         collect_detected_corners(image->observation.board->detection))
      coverage.add_corner(corner.pixel);
  }
  return coverage;
}

namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

struct LocatedFrame {
  double z_m, lamps_above_m, yaw_rad;
  std::size_t number;
};

std::vector<LocatedFrame> locate_frames(const std::vector<Frame>& frames,
                                        const StationConfig& config,
                                        const Calibration& calibration) {
  PositionerOptions options;
  options.correction = Correction::none;
  const Positioner positioner(config.lamps, calibration, options);
  double ceiling_m = 0;
  for (const Lamp& lamp : config.lamps.lamps) ceiling_m = std::max(ceiling_m, lamp.position_m.z());
  std::vector<LocatedFrame> located;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.compute_position_fix(frames[i].detections);
    if (!fix.has_succeeded()) continue;
    const auto& pose = fix.state.pose;
    located.push_back({pose.position_m.z(), ceiling_m - pose.position_m.z(), pose.yaw_rad, i});
  }
  std::ranges::sort(located, {}, &LocatedFrame::z_m);
  return located;
}

}  // namespace

YawCoverage compute_yaw_coverage(const std::vector<Frame>& frames, const StationConfig& config,
                                 const Calibration& calibration) {
  constexpr double same_height = 0.06;  // detect_pivots() decides
  const auto parts = static_cast<std::size_t>(config.completion.rotation_captures);
  const auto located = locate_frames(frames, config, calibration);
  YawCoverage map;
  for (std::size_t begin = 0, end = 0; begin < located.size(); begin = end) {
    YawCoverage::Height height{located[begin].z_m, 0, 0, std::vector<bool>(parts)};
    while (end < located.size() &&
           located[end].z_m - located[begin].z_m < same_height * located[begin].lamps_above_m) {
      ++end;
    }
    const std::span<const LocatedFrame> at_height(located.data() + begin, end - begin);
    const LocatedFrame& first = *std::ranges::min_element(at_height, {}, &LocatedFrame::number);
    std::vector<double> yaws_rad;
    for (const LocatedFrame& located_frame : at_height) {
      yaws_rad.push_back(located_frame.yaw_rad);
      const double turned = (located_frame.yaw_rad - first.yaw_rad) / kTurn_rad;
      const double fraction = turned - std::floor(turned);
      const auto part = static_cast<std::size_t>(std::lround(fraction * double(parts)));
      height.covered_sectors[part % parts] = true;
    }
    height.captures = static_cast<int>(yaws_rad.size());
    height.arc_rad = measure_arc(yaws_rad);
    height.is_complete = height.captures >= config.completion.rotation_captures &&
                         height.arc_rad >= config.completion.rotation_arc_rad;
    map.heights.push_back(std::move(height));
  }
  map.sufficient = std::ranges::count_if(map.heights, &YawCoverage::Height::is_complete) >=
                   config.completion.rotation_heights;
  return map;
}

std::optional<double> compute_median_blur_px(const UnitStep& boards) {
  std::vector<double> blurs_px;
  for (const auto& [name, image] : boards.images) {
    const bool counts = image.is_image_used() || !boards.sufficient;
    if (counts && image.observation.blur_px) blurs_px.push_back(*image.observation.blur_px);
  }
  if (blurs_px.empty()) return std::nullopt;
  return upper_median(std::move(blurs_px));
}

StepPlot render_plot_async(std::function<Drawing()> drawing) {
  const auto draw = [drawing = std::move(drawing)]() -> std::optional<ReportPlot> {
    try {
      return render_report_plot(drawing());
    } catch (const InputError&) {  // no gnuplot: a report without it is better than none
      return std::nullopt;
    }
  };
  return std::async(std::launch::async, draw).share();
}

}  // namespace vlp
