// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "positioning/positioner.h"
#include "program/app.h"
#include "session/lamp_images.h"
#include "session/rotation_step.h"

namespace vlp {

/// How to find the lamps in captures. Names of files are for messages, too.
struct CaptureOptions {
  /// A folder of images, a video, or a detections.csv.
  std::string images;
  std::string lamps, calibration, output;
  /// Empty: lamps are told apart by the map's frequencies.
  std::string classifier;
  /// Where pictures of what was found go; empty: none are made.
  std::string annotate;
  /// Where lights.csv goes; empty: nowhere.
  std::string lights;
  std::optional<Readout> readout;
  /// Of a camera without a calibration.
  std::optional<double> row_time_s;
  std::optional<double> exposure_s;
  int threads = all_cores();
  double max_mpx = kUsualMaxMpx;
  /// Of a video every so many-th frame.
  int every = 1;
  /// As LampImages have them.
  std::optional<CapturesTable> captures;
  double yaw_in_robot_rad = 0;
};

/// What --help says of the options that every program has which takes captures of lamps.
struct CaptureTexts {
  const char* images;
  const char* calibration;
  const char* output;
};

/// Adds images, --lamps, --calibration, --output, and those of add_detect_options().
void add_capture_options(CLI::App& app, CaptureOptions& options, const CaptureTexts& texts);

/// Adds --readout rows|columns.
void add_readout_option(CLI::App& app, std::optional<Readout>& readout);

/// The lens model that --lens has for the one that the views call for.
inline constexpr const char* kChosenLens = "auto";

/// Adds --lens MODEL|auto, of those programs that find a lens.
void add_lens_option(CLI::App& app, std::string& lens);

/// Adds --every, of those programs that take videos.
void add_every_option(CLI::App& app, int& every);

/// Throws std::invalid_argument when `every` is asked of files among which there is no video.
void check_every(int every, const std::vector<std::string>& files);

/// Adds --max-mpx.
void add_max_mpx_option(CLI::App& app, double& max_mpx);

/// Adds --classifier, --annotate, --readout, --exposure-s, --max-mpx and --threads.
void add_detect_options(CLI::App& app, CaptureOptions& options);

/// How cameras move while their images are read.
struct MotionOptions {
  std::optional<double> max_speed_m_per_s, max_yaw_rate_deg_per_s;

  /// Nothing: they stand.
  std::optional<KnownMotion> motion() const;
};

/// Adds --max-speed-m-per-s, with this help, and --max-yaw-rate-deg-per-s.
void add_motion_options(CLI::App& app, MotionOptions& options, const char* help);

/// Adds --yaw-rate-sd-deg-per-s, of captures.csv.
void add_yaw_rate_sd_option(CLI::App& app, std::optional<double>& yaw_rate_sd_deg_per_s);

/// What the result depends on: captures, lamp map, calibration, classifier; an empty name is an
/// input that was not given.
std::vector<std::string> inputs_of(const CaptureOptions& options);

/// For see_lamps() of the session.
LampImages lamp_images(const CaptureOptions& options, const LampMap& lamps,
                       const std::optional<Calibration>& calibration);

/// Each light, for --verbose.
void tell_of_lights(const std::vector<LightsOfImage>& lights);

/// The lamps in a folder of images, or in a video, with progress, and with what there is to say of
/// it, and with `lights` written; whether there are some is not required. Neither `output` nor
/// `lights` may be one of the images. Throws as see_lamps().
SeenLamps look_for_lamps(const CaptureOptions& options, const LampMap& lamps,
                         const std::optional<Calibration>& calibration);

/// The same, and throws when it fails.
SeenLamps see_lamps(const CaptureOptions& options, const LampMap& lamps,
                    const std::optional<Calibration>& calibration);

/// Lamp map, calibration, and the captures of a detections.csv or of a folder of images. Throws
/// what see_lamps() and the files' readers throw, and std::invalid_argument when options for images
/// are given with a table.
LampCaptures read_captures_of(const CaptureOptions& options);

}  // namespace vlp
