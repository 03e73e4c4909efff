// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "detection/detect_captures.h"
#include "detection/detect_lights.h"
#include "detection/image_source.h"
#include "detection/lights_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "session/step_result.h"

namespace vlp {

/// A folder of images, or a video, to look for lamps.
struct LampImages {
  std::filesystem::path folder;
  LampMap lamps;
  std::filesystem::path lamps_file;
  /// Without one centres are those of ellipses in the image.
  std::optional<Calibration> camera;
  std::filesystem::path camera_file = {};
  /// Of a camera without a calibration.
  std::optional<double> row_time_s = {};
  /// By vlp-train; empty: lamps are told apart by the map's frequencies.
  std::filesystem::path classifier_file = {};
  /// Goes before what the calibration says; without either the images tell it.
  std::optional<Readout> readout = {};
  /// For the check of the lamp map; short when it is not known.
  std::optional<double> exposure_s = {};
  /// Folder for pictures of what was found; made when it is not there. Empty: none.
  std::filesystem::path annotate = {};
  /// Images at a time.
  int threads = 1;
  /// Larger images are refused unread.
  double max_mpx = kUsualMaxMpx;
  /// Of a video every so many-th frame.
  int every = 1;
  /// Of the images, whose inclination counts when there is a camera; nothing: captures.csv of the
  /// folder.
  std::optional<CapturesTable> captures = {};
  /// Of the camera, for inclinations of the robot.
  double yaw_in_robot_rad = 0;
};

/// The lamps in each image that can be used.
struct SeenLamps : StepResult {
  std::vector<Frame> frames;
  /// All lights of each frame's image, without outlines.
  std::vector<LightsOfImage> lights;
  int images = 0;
  /// Of a video's frames, since its start, by the name that the frame has in `frames`.
  std::map<std::string, double> times_s;
};

/// Throws InputError: no row time, no frequency, no image or none that can be used, a classifier of
/// other lamps or of another row time, a captures.csv that cannot be read. undetermined: no lamp is
/// identified. Warns of lamps of the map that are too much alike.
SeenLamps see_lamps(const LampImages& input, const StepProgress& progress = {});

/// The lamps in those of the images once more, with what is known by now of how their cameras
/// leaned. Precondition: see_lamps() could use them, with the same input, which is no video.
CaptureDetections see_lamps_again(const LampImages& input, const LevelsOfImages& levels);

/// Along what the shutter reads: as `stated`, or else as the images show; a note, or a warning when
/// not even they tell and rows are taken, goes to `result`.
Readout readout_of(std::vector<std::filesystem::path> images, const std::optional<Readout>& stated,
                   StepResult& result, const FromVideos& from_videos = {});

/// Throws InputError when no lamp has a frequency.
void check_frequencies(const LampMap& lamps, const std::filesystem::path& lamps_file);

/// Throws InputError when the map has none of the lamps that the captures show.
void check_lamps(std::span<const Frame> frames, const LampMap& lamps,
                 const std::filesystem::path& lamps_file);

}  // namespace vlp
