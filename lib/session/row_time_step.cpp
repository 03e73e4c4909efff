// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_step.h"

#include <fmt/core.h>

#include <array>
#include <map>
#include <utility>

#include "frontend/image_folder.h"
#include "frontend/lamp_intake.h"
#include "session/position_cost.h"
#include "session/row_time_check.h"
#include "session/skipped_images.h"

namespace vlp {

namespace fs = std::filesystem;

namespace {

/// Lights of the images of all folders with their periods, and the sizes of the images.
/// LightPeriod::image is an index into the images of all folders.
struct PeriodsOfImages {
  std::vector<LightPeriod> lights;
  std::vector<std::array<int, 2>> sizes_px;

  PeriodsOfImages(const std::vector<const std::vector<Observation>*>& folders,
                  const std::vector<std::vector<Frame>>& labels) {
    for (std::size_t i = 0; i < folders.size(); ++i) {
      for (LightPeriod light : collect_periods(*folders[i], labels[i])) {
        light.image += sizes_px.size();
        lights.push_back(std::move(light));
      }
      for (const Observation& image : *folders[i]) sizes_px.push_back(image.size_px);
    }
  }

  /// Returns the lights of each image with their groups. Omits a group in an image with several of
  /// its lights, because at most one of them is the lamp.
  std::vector<GroupedLights> group_lights(const std::vector<PeriodGroup>& groups) const {
    std::vector<GroupedLights> images;
    for (const std::array<int, 2>& size_px : sizes_px) images.push_back({size_px, {}});
    for (std::size_t group = 0; group < groups.size(); ++group) {
      std::map<std::size_t, int> count;  // by image
      for (const std::size_t i : groups[group].lights) ++count[lights[i].image];
      for (const std::size_t i : groups[group].lights) {
        const LightPeriod& light = lights[i];
        if (count[light.image] > 1) continue;
        images[light.image].lights.push_back({group, light.pixel, light.sigma_px});
      }
    }
    return images;
  }
};

/// Collects the images of all folders, without their lights.
std::vector<Observation> collect_images(const DetectedLights& seen) {
  std::vector<Observation> images;
  for (const Observations& folder : seen.folders) {
    for (const Observation& image : folder.images) {
      images.push_back({image.file});
      images.back().rejection = image.rejection;
    }
  }
  return images;
}

}  // namespace

RowTimeResult choose_row_time_by_places(const std::vector<const std::vector<Observation>*>& folders,
                                        const std::vector<std::vector<Frame>>& labels,
                                        const LampMap& lamps, const std::optional<Lens>& lens) {
  const PeriodsOfImages periods(folders, labels);
  const RowTimeCandidates found = estimate_row_time(
      std::vector<MeasuredPeriod>(periods.lights.begin(), periods.lights.end()), lamps);
  if (found.candidates.size() < 2) return choose_row_time(found);
  const auto images = periods.group_lights(found.groups);
  return choose_row_time(found, compute_position_costs(found, images, lamps, lens));
}

DetectedLights detect_lights(const std::vector<fs::path>& folders, const LampMap& lamps,
                             const std::optional<Calibration>& calibration, bool with_row_time,
                             const FrontendOptions& options, const IntakeProgress& progress) {
  DetectedLights seen;
  std::optional<std::array<int, 2>> imager_px;
  std::optional<Readout> readout = options.readout;
  if (calibration) {
    seen.camera = make_detector_camera(*calibration);
    imager_px = calibration->camera.imager_px;
    if (!readout) readout = calibration->camera.readout;
  }
  // The estimate must not depend on the given row time.
  if (!with_row_time) seen.camera.row_time_s.reset();
  std::vector<std::vector<fs::path>> images;
  std::vector<fs::path> all;
  for (const fs::path& folder : folders) {
    images.push_back(list_images(folder));
    all.insert(all.end(), images.back().begin(), images.back().end());
  }
  Observations remarks;
  seen.camera.readout = find_readout(all, readout, options, imager_px, remarks);
  const LampIntake intake(LightDetector(lamps, seen.camera), ImageUse::fixes, options, imager_px);
  std::size_t before = 0;
  for (const auto& files : images) {
    seen.folders.push_back(intake.observe_all(files, [&](std::size_t done, std::size_t) {
      if (progress) progress(before + done, all.size());
    }));
    before += files.size();
  }
  auto& first = seen.folders.front();
  first.notes.insert(first.notes.begin(), remarks.notes.begin(), remarks.notes.end());
  first.warnings.insert(first.warnings.begin(), remarks.warnings.begin(), remarks.warnings.end());
  check_any_readable(folders.front(), collect_images(seen));
  return seen;
}

void add_remarks(const DetectedLights& seen, StepResult& result) {
  Observations all;
  all.images = collect_images(seen);
  for (const Observations& folder : seen.folders) {
    all.notes.insert(all.notes.end(), folder.notes.begin(), folder.notes.end());
    all.warnings.insert(all.warnings.end(), folder.warnings.begin(), folder.warnings.end());
  }
  add_remarks(all, result);
}

RowTimeStepResult find_row_time(const DetectedLights& seen,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const fs::path& lamps_file,
                                const std::optional<Calibration>& calibration, HistoryEntry entry) {
  check_frequencies(lamps, lamps_file);
  RowTimeStepResult result;
  std::vector<const std::vector<Observation>*> folders;
  folders.reserve(seen.folders.size());
  for (const Observations& folder : seen.folders) folders.push_back(&folder.images);
  const RowTimeResult estimate =
      choose_row_time_by_places(folders, labels, lamps, seen.camera.lens);
  if (!estimate.found) {
    result.fail(StepFailure::undetermined, estimate.problem);
    return result;
  }
  result.found = *estimate.found;
  result.metrics = {{"row_time_us", 1e6 * result.found.row_time_s},
                    {"row_time_sd_us", 1e6 * result.found.sd_s}};
  if (!calibration) return result;
  if (const auto& stated_s = calibration->camera.row_time_s) {
    std::string error = compare_row_times(result.found, {*stated_s, "the calibration"});
    if (!error.empty()) result.warnings.push_back(std::move(error));
  }
  result.calibration = *calibration;
  result.calibration.camera.row_time_s = result.found.row_time_s;
  result.calibration.camera.readout = seen.camera.readout;
  entry.part = "camera";
  auto& history = result.calibration.history;
  std::erase_if(history, [&](const HistoryEntry& other) {  // entry of an earlier search
    return other.part == "camera" && other.program == entry.program &&
           other.options.find("--row-time") != std::string::npos;
  });
  history.push_back(std::move(entry));
  return result;
}

}  // namespace vlp
