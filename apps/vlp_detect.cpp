// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-detect: detects and identifies the lamps in images.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "frontend/lights_table.h"
#include "frontend/video.h"
#include "program/app.h"
#include "program/steps/capture_options.h"

namespace vlp {
namespace {

/// Returns the times of the frames of a video, by name.
std::map<std::string, double> frame_times(const std::vector<Observation>& images) {
  std::map<std::string, double> times_s;
  for (const Observation& image : images) {
    if (image.is_image_kept() && image.time_s)
      times_s.emplace(image.image_file_name(), *image.time_s);
  }
  return times_s;
}

void run(const CaptureOptions& options, const std::string& captures) {
  const std::vector<std::string> inputs = list_capture_files(options);
  check_outputs_distinct(
      {{"--output", options.output}, {"--lights", options.lights}, {"--captures", captures}},
      inputs);
  check_every_option(options.frontend.every, {options.images});
  if (!captures.empty() && !is_video_file_name(options.images)) {
    throw std::invalid_argument("--captures: images have no frame times; use it for a video only");
  }
  std::optional<Calibration> calibration;
  if (!options.calibration.empty()) {
    calibration = read_calibration(options.calibration);
  } else if (!options.frontend.row_time_s && options.frontend.classifier.empty()) {
    throw std::invalid_argument(
        "lamps cannot be identified; give --calibration, --row-time-s or --classifier");
  }
  const Observations found =
      detect_captured_lamps(options, ImageUse::fixes,
                            read_lamps_of_room(options.lamps, options.frontend.room), calibration);
  const std::vector<Frame> frames = collect_lamp_frames(found.images);
  write_detections(options.output, frames);
  if (!captures.empty()) write_capture_times(captures, frame_times(found.images));
  const auto empty = std::count_if(frames.begin(), frames.end(),
                                   [](const Frame& frame) { return frame.detections.empty(); });
  const auto count = [&](LightKind kind) { return count_lights(found.images, kind); };
  fmt::print("images      {}\n  skipped   {}\n  no lamp   {}\n", found.images.size(),
             found.images.size() - frames.size(), empty);
  fmt::print("lamps       {}\n", count(LightKind::lamp));
  fmt::print("no lamps    {} cut by the image border, {} unknown, {} steady, {} without outline\n",
             count(LightKind::truncated), count(LightKind::unknown), count(LightKind::unmodulated),
             count(LightKind::no_outline));
  for (const auto& [kind, reason, lights] : count_rejected_lights(found.images)) {
    fmt::print("  {:<8}  {}, {}: {}\n", lights, light_kind_name(kind), light_reason_name(reason),
               describe_light_reason(reason));
  }
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Detects lamps in images of a rolling-shutter camera and identifies them by their stripes. "
      "Writes only lamps that are completely visible and identified without ambiguity.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-detect datasets/paper-rig/rendered/sample \\\n"
      "    --lamps datasets/paper-rig/rendered/lamps.yaml \\\n"
      "    --calibration datasets/paper-rig/rendered/true_calibration.yaml \\\n"
      "    -o detections.csv\n",
      "vlp-detect");
  CLI::App& app = *parser;
  vlp::CaptureOptions options;
  app.add_option("images", options.images,
                 "Folder of images: PNG, JPEG, BMP, TIFF or PGM; or a video: AVI, MP4, MOV, MKV or "
                 "WebM. With --calibration, inclinations in captures.csv of the folder are applied")
      ->required();
  app.add_option("--lamps", options.lamps,
                 "Lamp map, lamps.yaml. Needs frequencies unless --classifier is given")
      ->required();
  app.add_option("--calibration", options.calibration,
                 "Calibration of the camera, with row time and, if known, tilt. Without it, "
                 "centers are those of ellipses in the image");
  app.add_option("--row-time-s", options.frontend.row_time_s,
                 "Row time of a camera without calibration, in s")
      ->check(vlp::make_positive_validator())
      ->excludes("--calibration");
  app.add_option("-o,--output", options.output, "Output file of detections, CSV")->required();
  app.add_option("--lights", options.lights,
                 "Output file of all lights, CSV, with class, reason and measured values");
  std::string captures;
  app.add_option("--captures", captures, "Output file of the frame times of a video, captures.csv");
  vlp::add_every_option(app, options.frontend.every);
  vlp::add_lamp_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(options, captures); });
}
