// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "frontend/lamp_intake.h"
#include "positioning/positioner.h"
#include "program/app.h"
#include "session/lamp_captures.h"

namespace vlp {

/// Returns the defaults of a program: all cores.
FrontendOptions default_frontend();

/// Captures of lamps as the command line names them. Names of files are for messages, too.
struct CaptureOptions {
  /// A folder of images, a video, or a detections.csv.
  std::string images;
  std::string lamps, calibration, output;
  /// File for lights.csv; empty: none.
  std::string lights;
  FrontendOptions frontend = default_frontend();
  /// As in LampImages.
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

/// Adds --room.
void add_room_option(CLI::App& app, std::string& room);

/// Writes a corrected lamp map, and prints which lamps are in it if there is a `room`.
void write_refined_map(const std::filesystem::path& file, const LampMap& map,
                       const std::string& room);

/// Adds --max-mpx.
void add_max_mpx_option(CLI::App& app, double& max_mpx);

/// Adds --max-blur-px and --max-white-fraction, the limits of board images.
void add_board_limit_options(CLI::App& app, FrontendOptions& options);

/// Adds --room, --classifier, --annotate, --readout, --exposure-s, --max-mpx and --threads.
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

/// Returns the images with lamp map and calibration for observe_lamps().
LampImages lamp_images(const CaptureOptions& options, const LampMap& lamps,
                       const std::optional<Calibration>& calibration);

/// Throws std::invalid_argument if `output` or `lights` is one of the images.
void check_image_outputs(const CaptureOptions& options);

/// Prints each light if --verbose is given.
void print_lights(const Observations& seen);

/// Detects the lamps in a folder of images or a video, with progress, and prints the remarks, a
/// contradiction between the lamps and the stated row time included. Throws as observe_lamps(), and
/// if no lamp is identified.
Observations observe_captures(const CaptureOptions& options, ImageUse use, const LampMap& lamps,
                              const std::optional<Calibration>& calibration);

/// Reads lamp map, calibration, and the captures of a detections.csv or of a folder of images.
/// Throws as observe_captures() and the readers of the files do, and std::invalid_argument if
/// options for images are given with a table.
LampCaptures read_captures_of(const CaptureOptions& options, ImageUse use);

/// Reads the captures of a detections.csv. Throws std::invalid_argument for a video, and for
/// options that are for images.
std::vector<Frame> read_detections_of(const CaptureOptions& options);

}  // namespace vlp
