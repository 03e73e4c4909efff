// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/capture_options.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <utility>

#include "camera/lens_model.h"
#include "captures/printable.h"
#include "frontend/image_file.h"
#include "frontend/lights_table.h"
#include "frontend/video.h"
#include "geometry/angles.h"
#include "program/progress.h"
#include "program/steps/step_outcome.h"
#include "rig/lamp_map_file.h"
#include "session/row_time_step.h"

namespace vlp {

FrontendOptions make_intake_options() {
  FrontendOptions options;
  options.threads = count_cpu_cores();
  return options;
}

void add_capture_options(CLI::App& app, CaptureOptions& options, const CaptureTexts& texts) {
  app.add_option("images", options.images, texts.images)->required();
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.calibration, texts.calibration)->required();
  app.add_option("-o,--output", options.output, texts.output)->required();
  add_lamp_options(app, options);
}

void add_lens_model(CLI::App& app, std::string& lens) {
  app.add_option("--lens", lens,
                 "Lens model (default: LENSMODEL_OPENCV8). auto: selected by cross-validation over "
                 "the views")
      ->check([](const std::string& name) {
        const bool known = name == kAutomaticLens || lens_model_from_name(name);
        return known ? std::string() : "the models are: auto, " + list_lens_model_names();
      });
}

void add_readout(CLI::App& app, std::optional<Readout>& readout) {
  static const std::map<std::string, Readout> names{{"rows", Readout::rows},
                                                    {"columns", Readout::columns}};
  app.add_option_function<std::string>(
         "--readout", [&readout](const std::string& name) { readout = names.at(name); },
         "Readout direction: image axis along which the shutter reads (default: that of the "
         "calibration, or estimated from the images)")
      ->check(CLI::IsMember({"rows", "columns"}))
      ->option_text("rows|columns");
}

void add_every_option(CLI::App& app, int& every) {
  app.add_option("--every", every, "Use every Nth frame of a video (default: 1)")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N");
}

void check_every_option(int every, const std::vector<std::string>& files) {
  if (every == 1 || std::any_of(files.begin(), files.end(), is_video_file_name)) return;
  throw std::invalid_argument("--every: there is no video; leave it out");
}

void add_room_option(CLI::App& app, std::string& room) {
  app.add_option("--room", room,
                 "Room whose lamps are used, by the key room in the lamp map (default: all lamps)");
}

void write_refined_map(const std::filesystem::path& file, const LampMap& map,
                       const std::string& room) {
  write_lamp_map(file, map);
  if (room.empty()) return;
  fmt::print("{} contains the lamps of room {} only: use it without --room\n",
             escape_for_terminal(file.string()), escape_for_terminal(room));
}

void add_max_mpx_option(CLI::App& app, double& max_mpx) {
  app.add_option(
         "--max-mpx", max_mpx,
         "Maximum size of an image, in megapixels; larger images are skipped unread (default: 200)")
      ->check(make_positive_validator())
      ->check(CLI::Range(0.001, 1e6));
}

void add_quality_options(CLI::App& app, FrontendOptions& options) {
  constexpr double min_limit = 1e-4, max_limit = 0.1;
  app.add_option("--max-blur-fraction", options.max_blur_fraction,
                 "Maximum blur of a board image: sigma of its sharpest edges, as a fraction of the "
                 "longer side; others are skipped (default: 0.003)")
      ->check(CLI::Range(min_limit, max_limit));
  app.add_option("--max-white-fraction", options.max_white_fraction,
                 "Maximum fraction of the board at full scale in an image; others are used only if "
                 "their corners are measured well (default: 0.25)")
      ->check(CLI::Range(0.0, 1.0));
}

void add_lamp_options(CLI::App& app, CaptureOptions& options) {
  add_room_option(app, options.frontend.room);
  app.add_option("--classifier", options.frontend.classifier,
                 "Lamp classifier of vlp-train, used instead of the frequencies in the map");
  app.add_option("--annotate", options.frontend.annotate,
                 "Output folder of annotated images with outlines, centers and lamp ids");
  add_readout(app, options.frontend.readout);
  app.add_option(
         "--exposure-s", options.frontend.exposure_s,
         "Exposure time of the images, in s, for the check of the lamp map (default: short)")
      ->check(make_positive_validator());
  add_max_mpx_option(app, options.frontend.max_mpx);
  add_threads_option(app, options.frontend.threads);
}

std::optional<KnownMotion> MotionOptions::make_motion_prior() const {
  constexpr double fastest_deg_per_s = 180;  // maximum yaw rate of robots
  if (!max_speed_m_per_s) return std::nullopt;
  return KnownMotion::make_motion_prior_from_limits(
      *max_speed_m_per_s, rad_from_deg(max_yaw_rate_deg_per_s.value_or(fastest_deg_per_s)));
}

void add_motion_options(CLI::App& app, MotionOptions& options, const char* help) {
  app.add_option("--max-speed-m-per-s", options.max_speed_m_per_s, help)
      ->check(make_positive_validator());
  app.add_option(
         "--max-yaw-rate-deg-per-s", options.max_yaw_rate_deg_per_s,
         "Maximum yaw rate with --max-speed-m-per-s, in degrees/s (default: 180); 0: no rotation")
      ->check(make_non_negative_validator())
      ->needs("--max-speed-m-per-s");
}

void add_yaw_rate_sd(CLI::App& app, std::optional<double>& yaw_rate_sd_deg_per_s) {
  app.add_option("--yaw-rate-sd-deg-per-s", yaw_rate_sd_deg_per_s,
                 "Standard deviation of yaw_rate_rad_per_s in captures.csv, in degrees/s (default: "
                 "0, exact)")
      ->check(make_non_negative_validator());
}

std::vector<std::string> list_capture_files(const CaptureOptions& options) {
  return {options.images, options.lamps, options.calibration, options.frontend.classifier.string()};
}

LampImages make_lamp_images(const CaptureOptions& options, const LampMap& lamps,
                            const std::optional<Calibration>& calibration) {
  return {options.images,          lamps,
          options.lamps,           calibration,
          options.calibration,     options.captures,
          options.yaw_in_robot_rad};
}

void check_outputs(const CaptureOptions& options) {
  if (is_video_file_name(options.images)) return;
  for (const auto& image : list_images(options.images)) {
    check_output_is_no_input(options.output, {image.string()});
    if (!options.lights.empty()) check_output_is_no_input(options.lights, {image.string()});
  }
}

void print_lights(const Observations& seen) {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  for (const Observation& image : seen.images) {
    for (const Light& light : image.lights)
      spdlog::debug("{}: {}", image.image_file_name(), describe_light(light));
  }
}

Observations detect_captured_lamps(const CaptureOptions& options, ImageUse use,
                                   const LampMap& lamps,
                                   const std::optional<Calibration>& calibration) {
  check_outputs(options);
  Observations seen;
  {
    Progress progress("images");
    seen = detect_lamps(make_lamp_images(options, lamps, calibration), use, options.frontend,
                        [&](std::size_t done, std::size_t total) { progress.update(done, total); });
  }
  StepResult remarks;
  add_intake_remarks(seen, remarks);
  // A classifier identifies lamps without the row time.
  if (options.frontend.classifier.empty() || remarks.has_succeeded()) {
    const auto camera = calibration
                            ? make_detector_camera(*calibration)
                            : DetectorCamera{Readout::rows, options.frontend.row_time_s, {}};
    const auto file = std::filesystem::path(options.calibration).filename();
    add_row_time_remark(seen.images, lamps, camera, calibration ? file.string() : "--row-time-s",
                        remarks);
  }
  print_step_remarks(remarks);
  print_lights(seen);
  if (!options.lights.empty()) write_lights_table(options.lights, seen.images);
  require_success(remarks);
  return seen;
}

LampCaptures read_lamp_captures(const CaptureOptions& options, ImageUse use) {
  LampCaptures captures{{},
                        read_overhead_lamps(options.lamps, options.frontend.room),
                        options.lamps,
                        read_calibration(options.calibration)};
  const std::optional<Readout>& readout = options.frontend.readout;
  if (readout) captures.calibration.camera.readout = readout;
  captures.frames =
      std::filesystem::is_directory(options.images)
          ? collect_lamp_frames(
                detect_captured_lamps(options, use, captures.lamps, captures.calibration).images)
          : read_detected_captures(options);
  return captures;
}

std::vector<Frame> read_detected_captures(const CaptureOptions& options) {
  if (is_video_file_name(options.images)) {
    throw std::invalid_argument(options.images +
                                " is a video; use vlp-detect, with --captures for the frame times");
  }
  const FrontendOptions& frontend = options.frontend;
  const std::array<std::pair<const char*, bool>, 3> image_options{
      {{"--classifier", !frontend.classifier.empty()},
       {"--annotate", !frontend.annotate.empty()},
       {"--exposure-s", frontend.exposure_s.has_value()}}};
  for (const auto& [name, is_given] : image_options) {
    if (!is_given) continue;
    throw std::invalid_argument(
        fmt::format("{}: {} is no folder of images; leave the option out", name, options.images));
  }
  return read_detections(options.images);
}

}  // namespace vlp
