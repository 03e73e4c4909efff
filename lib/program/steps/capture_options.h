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

/// Returns the default options of a program, with one thread per core.
FrontendOptions make_intake_options();

/// Command-line options of programs that take captures of lamps: input and output files, and the
/// options of the detection. File names are also used in messages.
struct CaptureOptions {
  /// Folder of images, video, or detections.csv.
  std::string images;
  std::string lamps, calibration, output;
  /// File for lights.csv; empty: none.
  std::string lights;
  FrontendOptions frontend = make_intake_options();
  /// Table of the captures, and yaw of the camera on the robot (LampImages).
  std::optional<CapturesTable> captures;
  double yaw_in_robot_rad = 0;
};

/// Texts in --help for the options of all programs that take captures of lamps.
struct CaptureTexts {
  const char* images;
  const char* calibration;
  const char* output;
};

/// Adds images, --lamps, --calibration, --output, and those of add_lamp_options().
void add_capture_options(CLI::App& app, CaptureOptions& options, const CaptureTexts& texts);

/// Adds --readout rows|columns.
void add_readout(CLI::App& app, std::optional<Readout>& readout);

/// Value of --lens for the model selected by cross-validation.
inline constexpr const char* kAutomaticLens = "auto";

/// Adds --lens MODEL|auto, for programs that estimate a lens.
void add_lens_model(CLI::App& app, std::string& lens);

/// Adds --every, for programs that take videos.
void add_every_option(CLI::App& app, int& every);

/// Throws std::invalid_argument if `every` is not 1 and none of the files is a video.
void check_every_option(int every, const std::vector<std::string>& files);

/// Adds --room.
void add_room_option(CLI::App& app, std::string& room);

/// Writes a corrected lamp map, and prints which lamps are in it if there is a `room`.
void write_refined_map(const std::filesystem::path& file, const LampMap& map,
                       const std::string& room);

/// Adds --max-mpx.
void add_max_mpx_option(CLI::App& app, double& max_mpx);

/// Adds --max-blur-fraction and --max-white-fraction, the limits of board images.
void add_quality_options(CLI::App& app, FrontendOptions& options);

/// Adds --room, --classifier, --annotate, --readout, --exposure-s, --max-mpx and --threads.
void add_lamp_options(CLI::App& app, CaptureOptions& options);

/// Options of the motion of a camera during readout.
struct MotionOptions {
  std::optional<double> max_speed_m_per_s, max_yaw_rate_deg_per_s;

  /// Returns the prior of the motion; std::nullopt if the camera stands.
  std::optional<KnownMotion> make_motion_prior() const;
};

/// Adds --max-speed-m-per-s, with the text `help`, and --max-yaw-rate-deg-per-s.
void add_motion_options(CLI::App& app, MotionOptions& options, const char* help);

/// Adds --yaw-rate-sd-deg-per-s, the standard deviation of yaw rates in captures.csv.
void add_yaw_rate_sd(CLI::App& app, std::optional<double>& yaw_rate_sd_deg_per_s);

/// Returns the inputs of the result: captures, lamp map, calibration, classifier; an empty name is
/// an input that was not given.
std::vector<std::string> list_capture_files(const CaptureOptions& options);

/// Returns the images with lamp map and calibration for detect_lamps().
LampImages make_lamp_images(const CaptureOptions& options, const LampMap& lamps,
                            const std::optional<Calibration>& calibration);

/// Throws std::invalid_argument if `output` or `lights` is one of the images.
void check_outputs(const CaptureOptions& options);

/// Prints each light if --verbose is given.
void print_lights(const Observations& seen);

/// Detects the lamps in a folder of images or a video, with a progress display. Prints the remarks,
/// including a contradiction between the lamps and the given row time. Throws as
/// detect_lamps() does, and if no lamp is identified.
Observations detect_captured_lamps(const CaptureOptions& options, ImageUse use,
                                   const LampMap& lamps,
                                   const std::optional<Calibration>& calibration);

/// Reads lamp map, calibration, and the captures of a detections.csv or of a folder of images.
/// Throws as detect_captured_lamps() and the readers of the files do, and std::invalid_argument
/// if options for images are given with a table.
LampCaptures read_lamp_captures(const CaptureOptions& options, ImageUse use);

/// Reads the captures of a detections.csv. Throws std::invalid_argument for a video, and if options
/// for images are given.
std::vector<Frame> read_detected_captures(const CaptureOptions& options);

}  // namespace vlp
