// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "detection/boards/detect_boards.h"
#include "lamps/light_detector.h"
#include "rig/detection.h"
#include "station/station_config.h"

namespace vlp {

/// Why an image that is good is not used.
enum class Superfluous {
  no,
  same_pose,  // another one shows the same
  enough      // the step is done without it
};

/// An image of a unit, and what the station makes of it.
struct UnitImage {
  std::filesystem::path file;
  std::string sha256;
  /// Why it is not used, for people; empty when it is.
  std::string refused = {};
  /// Nothing is wrong with it, but others of its step show the same, or are enough.
  Superfluous superfluous = Superfluous::no;
  /// The file is no more: a frame of a camera or a video that was refused.
  bool discarded = false;
  /// Of the step `boards`; there also when the image is refused, but for one that shows no board.
  std::optional<BoardView> view = {};
  std::optional<double> blur_px = {};
  /// Of the other steps. level_from_camera that they were looked for with; zero: the calibrated
  /// one.
  Eigen::Matrix3d level = Eigen::Matrix3d::Zero();
  std::vector<Detection> lamps = {};
  int lights_cut = 0, lights_unknown = 0;
  /// Of those whose stripes are plain, but like no lamp's, with the row time of the camera's type.
  std::vector<double> unknown_hz = {};
};

/// What a board image shows, refused when it cannot be read, is too dark, overexposed (a quarter of
/// the board at full scale) or blurred, or shows too little of the board. One bad image ends
/// nothing: it is refused with the reason.
UnitImage look_at_board(const std::filesystem::path& file, const StationConfig& config,
                        const BoardDetector& detector);

/// The same of lamps: refused when it cannot be read, nothing in it stands out of the noise, be it
/// too dark or all white (image_signal.h), or it shows fewer than two of them; said is whether they
/// are at full scale all over, where no stripes can be seen.
UnitImage look_at_lamps(const std::filesystem::path& file, const StationConfig& config,
                        const LightDetector& detector);

/// Whether two views show the board at the same place: the corners of the tags that both have are
/// closer than `distance_px` on average.
bool same_pose(const SeenBoard& a, const SeenBoard& b, double distance_px);

/// Whether both show the same lamps, each closer than `distance_px` to where it was.
bool same_lamps(const std::vector<Detection>& a, const std::vector<Detection>& b,
                double distance_px);

}  // namespace vlp
