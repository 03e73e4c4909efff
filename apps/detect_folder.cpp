// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detect_folder.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <utility>

#include "app.h"
#include "detection/image_file.h"
#include "progress.h"
#include "readout_option.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"
#include "warn_of_lamps.h"

namespace vlp {
namespace {

void check_row_time(const DetectOptions& options, const DetectorCamera& camera) {
  if (!camera.row_time_s) {
    throw InputError(
        options.calibration,
        "camera.row_time_s is missing: without it no stripe tells its lamp; --row-time-s of "
        "vlp-intrinsics states it, vlp-train --row-time finds it");
  }
}

LampClassifier classifier_for(const DetectOptions& options, const LampMap& lamps,
                              const DetectorCamera& camera) {
  LampClassifier classifier = read_lamp_classifier(options.classifier);
  for (const auto& lamp : classifier.lamps) {
    if (find_lamp(lamps.lamps, lamp.lamp) != nullptr) continue;
    throw InputError(options.classifier,
                     fmt::format("lamp {} is not in {}", lamp.lamp, options.lamps));
  }
  for (const Lamp& lamp : lamps.lamps) {
    const bool known = std::any_of(classifier.lamps.begin(), classifier.lamps.end(),
                                   [&](const auto& other) { return other.lamp == lamp.id; });
    if (!known) spdlog::warn("lamp {} is unknown to {}", lamp.id, options.classifier);
  }
  constexpr double same = 0.005;
  if (classifier.row_time_s && camera.row_time_s &&
      std::abs(*classifier.row_time_s / *camera.row_time_s - 1) > same) {
    throw InputError(
        options.classifier,
        fmt::format("row_time_s is {:.4g}, that of {} is {:.4g}: train it for this camera",
                    *classifier.row_time_s,
                    options.calibration.empty() ? "--row-time-s" : options.calibration,
                    *camera.row_time_s));
  }
  return classifier;
}

/// Made when it is not there.
std::filesystem::path picture_folder(const DetectOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(options.annotate, error);
  if (error) throw InputError(options.annotate, "cannot be made: " + error.message());
  if (std::filesystem::equivalent(options.annotate, options.folder, error)) {
    throw InputError(options.annotate, "holds the images: the pictures go into another folder");
  }
  return options.annotate;
}

void check_found(const CaptureDetections& found, const std::string& folder) {
  if (found.frames.empty()) {
    throw InputError(folder, fmt::format("none of its {} images can be used", found.images));
  }
  const auto [identified, cut, unknown, steady] = found.lights;
  if (identified > 0) return;
  throw Undetermined(fmt::format(
      "no lamp was identified wholly in view in {} images ({} skipped; {} lamps are cut by the "
      "image's edge, {} lights flicker unlike any lamp of the map, {} are steady): are lamp map, "
      "row time and read-out (or classifier) right, and is the exposure short?",
      found.images, found.refused.size(), cut, unknown, steady));
}

}  // namespace

std::vector<std::string> inputs_of(const DetectOptions& options) {
  return {options.folder, options.lamps, options.calibration, options.classifier};
}

void check_frequencies(const LampMap& lamps, const std::string& lamps_file) {
  const bool frequencies =
      std::any_of(lamps.lamps.begin(), lamps.lamps.end(),
                  [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); });
  if (!frequencies) {
    throw InputError(lamps_file, "no lamp has a frequency_hz: none could be told from another");
  }
}

void check_lamps(const std::vector<Frame>& frames, const LampMap& lamps,
                 const std::string& lamps_file) {
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (find_lamp(lamps.lamps, detection.lamp) != nullptr) return;
    }
  }
  throw InputError(lamps_file, "has none of the lamps that the captures show");
}

void add_detect_options(CLI::App& app, DetectOptions& options) {
  app.add_option("--classifier", options.classifier,
                 "Lamp classifier by vlp-train, instead of the map's frequencies");
  app.add_option("--annotate", options.annotate,
                 "Folder for pictures of the lights found, with outlines, centres and lamps");
  add_readout_option(app, options.readout);
  app.add_option("--exposure-s", options.exposure_s,
                 "Exposure of the images, for the check of the lamp map (default: short)")
      ->check(finite_positive());
  app.add_option("--threads", options.threads, "Images at a time (default: one a core)")
      ->check(CLI::Range(1, 1024));
}

CaptureDetections detect_folder(const DetectOptions& options, const LampMap& lamps,
                                const std::optional<Calibration>& calibration) {
  DetectorCamera camera = calibration ? detector_camera(*calibration)
                                      : DetectorCamera{Readout::rows, options.row_time_s, {}};
  std::optional<LampClassifier> classifier;
  if (options.classifier.empty()) {
    check_frequencies(lamps, options.lamps);
    check_row_time(options, camera);
  } else {
    classifier = classifier_for(options, lamps, camera);
  }
  const auto images = images_in(options.folder);
  for (const auto& image : images) check_output(options.output, {image.string()});
  cv::setNumThreads(1);  // the images themselves go in parallel
  DetectRun run{options.threads};
  std::optional<Readout> calibrated;
  if (calibration) {
    run.imager_px = calibration->camera.imager_px;
    calibrated = calibration->camera.readout;
  }
  camera.readout = readout_for(options.readout, calibrated, images);
  if (!classifier) warn_of_lamps(lamps, camera, calibration, options.exposure_s);
  if (!options.annotate.empty()) run.annotate = picture_folder(options);
  CaptureDetections found;
  {
    Progress progress("images");
    found = detect_captures(LampDetector(lamps, camera, std::move(classifier)), images, run,
                            [&](std::size_t done) { progress.update(done, images.size()); });
  }
  for (const std::string& refused : found.refused) spdlog::warn("{}; skipped", refused);
  check_found(found, options.folder);
  return found;
}

std::vector<Frame> frames_of(const DetectOptions& options, const LampMap& lamps,
                             const Calibration& calibration) {
  if (std::filesystem::is_directory(options.folder)) {
    return detect_folder(options, lamps, calibration).frames;
  }
  const std::array<std::pair<const char*, bool>, 4> of_images{
      {{"--classifier", !options.classifier.empty()},
       {"--annotate", !options.annotate.empty()},
       {"--readout", options.readout.has_value()},
       {"--exposure-s", options.exposure_s.has_value()}}};
  for (const auto& [name, given] : of_images) {
    if (!given) continue;
    throw std::invalid_argument(fmt::format("{}: {} is no folder of images", name, options.folder));
  }
  return read_detections(options.folder);
}

}  // namespace vlp
