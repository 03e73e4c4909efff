// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_step.h"

#include <fmt/core.h>

#include <utility>

#include "detection/image_file.h"
#include "rig/input_error.h"
#include "session/lamp_images.h"
#include "session/skipped_images.h"

namespace vlp {

namespace fs = std::filesystem;

SeenLights see_lights(const std::vector<fs::path>& folders, const LampMap& lamps,
                      const std::optional<Calibration>& calibration,
                      const std::optional<Readout>& readout, bool with_row_time, int threads,
                      const StepProgress& progress) {
  SeenLights seen;
  std::optional<std::array<int, 2>> imager_px;
  std::optional<Readout> stated = readout;
  if (calibration) {
    seen.camera = detector_camera(*calibration);
    imager_px = calibration->camera.imager_px;
    if (!stated) stated = calibration->camera.readout;
  }
  // What is looked for is not to depend on what is known of it.
  if (!with_row_time) seen.camera.row_time_s.reset();
  std::vector<std::vector<fs::path>> images;
  std::vector<fs::path> all;
  for (const fs::path& folder : folders) {
    images.push_back(images_in(folder));
    all.insert(all.end(), images.back().begin(), images.back().end());
  }
  seen.camera.readout = readout_of(all, stated, seen);
  const LightDetector detector(lamps, seen.camera);
  std::size_t before = 0;
  for (const auto& folder : images) {
    seen.folders.push_back(
        detect_lights(detector, folder, imager_px, threads, [&](std::size_t done) {
          if (progress) progress(before + done, all.size());
        }));
    before += folder.size();
  }
  std::vector<std::string> refused;
  for (const auto& folder : seen.folders) {
    for (const ImageLights& image : folder) {
      if (!image.refused.empty()) refused.push_back(image.refused);
    }
  }
  seen.skipped = skipped_images(all, refused);
  if (refused.size() == all.size()) throw nothing_usable(folders.front(), all.size(), seen);
  return seen;
}

RowTimeStepResult find_row_time(const SeenLights& seen,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const fs::path& lamps_file,
                                const std::optional<Calibration>& calibration, HistoryEntry entry) {
  check_frequencies(lamps, lamps_file);
  std::vector<MeasuredPeriod> periods;
  for (std::size_t i = 0; i < seen.folders.size(); ++i) {
    const auto more = measured_periods(seen.folders[i], labels[i]);
    periods.insert(periods.end(), more.begin(), more.end());
  }
  RowTimeStepResult result;
  const RowTimeResult estimate = choose_row_time(estimate_row_time(periods, lamps));
  if (!estimate.found) {
    result.fail(StepFailure::undetermined, estimate.problem);
    return result;
  }
  result.found = *estimate.found;
  result.metrics = {{"row_time_us", 1e6 * result.found.row_time_s},
                    {"row_time_sd_us", 1e6 * result.found.sd_s}};
  if (!calibration) return result;
  result.calibration = *calibration;
  result.calibration.camera.row_time_s = result.found.row_time_s;
  result.calibration.camera.readout = seen.camera.readout;
  entry.part = "camera";
  auto& history = result.calibration.history;
  std::erase_if(history, [&](const HistoryEntry& other) {  // of a search before
    return other.part == "camera" && other.program == entry.program &&
           other.options.find("--row-time") != std::string::npos;
  });
  history.push_back(std::move(entry));
  return result;
}

}  // namespace vlp
