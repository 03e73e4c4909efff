// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detect_folder.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "app.h"
#include "detection/image_file.h"
#include "progress.h"
#include "rig/input_error.h"

namespace vlp {

int all_cores() { return static_cast<int>(std::max(1U, std::thread::hardware_concurrency())); }

CaptureDetections detect_folder(const std::string& folder, const LampMap& lamps,
                                const std::string& lamps_file, const Calibration& calibration,
                                const std::string& calibration_file, const std::string& output,
                                int threads) {
  const bool frequencies =
      std::any_of(lamps.lamps.begin(), lamps.lamps.end(),
                  [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); });
  if (!frequencies) {
    throw InputError(lamps_file, "no lamp has a frequency_hz: none could be told from another");
  }
  const DetectorCamera camera = detector_camera(calibration);
  if (!camera.row_time_s) {
    throw InputError(calibration_file,
                     "camera.row_time_s is missing: without it no stripe tells its lamp");
  }
  const auto images = images_in(folder);
  for (const auto& image : images) check_output(output, {image.string()});
  cv::setNumThreads(1);  // the images themselves go in parallel
  CaptureDetections found;
  {
    Progress progress("images");
    found =
        detect_captures(LampDetector(lamps, camera), images, calibration.camera.imager_px, threads,
                        [&](std::size_t done) { progress.update(done, images.size()); });
  }
  for (const std::string& refused : found.refused) spdlog::warn("{}; skipped", refused);
  if (found.frames.empty()) {
    throw InputError(folder, fmt::format("none of its {} images can be used", found.images));
  }
  const auto [identified, cut, unknown, steady] = found.lights;
  if (identified == 0) {
    throw Undetermined(fmt::format(
        "no lamp was identified wholly in view in {} images ({} skipped; {} lamps are cut by the "
        "image's edge, {} lights flicker unlike any lamp of the map, {} are steady): are lamp map "
        "and row time right, and is the exposure short?",
        found.images, found.refused.size(), cut, unknown, steady));
  }
  return found;
}

std::vector<Frame> frames_of(const std::string& captures, const LampMap& lamps,
                             const std::string& lamps_file, const Calibration& calibration,
                             const std::string& calibration_file, const std::string& output) {
  if (!std::filesystem::is_directory(captures)) return read_detections(captures);
  return detect_folder(captures, lamps, lamps_file, calibration, calibration_file, output,
                       all_cores())
      .frames;
}

}  // namespace vlp
