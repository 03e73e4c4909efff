// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "frontend/selection.h"
#include "geometry/frames.h"
#include "lamps/light_detector.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// level_from_camera of images, by name; std::nullopt if unknown (LightDetector::leaning).
using LevelRotations = std::map<std::string, std::optional<Eigen::Matrix3d>>;

/// Returns level_from_camera of a robot's inclination. Only the direction of the zenith is defined,
/// which is all that a detector uses.
Eigen::Matrix3d level_rotation(const Inclination& inclination, double yaw_in_robot_rad,
                               const Eigen::Matrix3d& base_from_camera);

/// Returns the level rotations of the images whose inclination is in the table.
LevelRotations level_rotations(const CapturesTable& captures, const Calibration& calibration,
                               double yaw_in_robot_rad);

/// Images of lamps with the lamp map and the camera.
struct LampImages {
  /// A folder of images, or a video.
  std::filesystem::path images;
  LampMap lamps;
  std::filesystem::path lamps_file;
  /// Without a calibration, centres are those of ellipses in the image.
  std::optional<Calibration> calibration = {};
  std::filesystem::path calibration_file = {};
  /// Inclinations of the images; used if there is a calibration. std::nullopt: captures.csv in the
  /// folder.
  std::optional<CapturesTable> captures = {};
  /// Yaw of the camera on the robot whose inclinations are given.
  double yaw_in_robot_rad = 0;
};

/// Detects lamps in images and rejects those that their use does not permit. Safe to share between
/// threads.
class LampIntake {
 public:
  /// `imager_px`: size of the camera's images, if it is known. `levels`: of images whose camera is
  /// tilted differently from the detector's.
  LampIntake(LightDetector detector, ImageUse use, const FrontendOptions& options,
             const std::optional<std::array<int, 2>>& imager_px, LevelRotations levels = {});

  /// Prepares the intake of a set of images: reads the classifier and estimates the readout
  /// direction if it is not known. Remarks are added to `result`. Throws InputError: no row time,
  /// no frequency, no image, a classifier of other lamps or of another row time, a captures.csv
  /// that cannot be read.
  LampIntake(const LampImages& images, ImageUse use, const FrontendOptions& options,
             Observations& result);

  /// Detects the lamps of an image. Rejects the image if it is unreadable, of another size, too
  /// dark, overexposed, or shows fewer lamps than its use needs. Repeated images are not rejected
  /// here, see Selection. Throws InputError if a picture of the lights cannot be written.
  Observation observe(const SourceImage& source) const;

  /// Returns an intake for the repetition of a detection: with other level rotations for some
  /// images, of which none is rejected for what it shows.
  LampIntake with_levels(const LevelRotations& levels) const;
  /// Returns the same intake with, or without (empty), pictures of the detected lights.
  LampIntake with_annotate(const std::filesystem::path& folder) const;

  /// Applies observe() to images and videos.
  Observations observe_all(const std::vector<std::filesystem::path>& files,
                           const IntakeProgress& progress = {}) const;

  Readout readout() const { return detector_.readout(); }

 private:
  std::optional<LightDetector> detector_for(const std::string& image) const;

  LevelRotations levels_;
  LightDetector detector_;
  ImageUse use_;
  FrontendOptions options_;
  std::optional<std::array<int, 2>> imager_px_;
  /// True if an image may be read out in the other direction (detect_either_way()).
  bool can_turn_ = false;
};

/// Returns the image files of a folder, or the video.
std::vector<std::filesystem::path> list_lamp_images(const std::filesystem::path& images);

/// Detects the lamps in a set of images (LampIntake) and rejects repeated images (Selection).
/// Warns of lamps in the map that are hard to distinguish. Observations::failure: no lamp is
/// identified, or no image can be used. Throws InputError as LampIntake does, and if no image can
/// be read.
Observations observe_lamps(const LampImages& images, ImageUse use, const FrontendOptions& options,
                           const IntakeProgress& progress = {});

/// Sets Observations::failure if no lamp is identified in any image, or no image is kept. Throws
/// InputError if no image can be read.
void check_lamps_seen(const LampImages& images, Observations& result);

/// Estimates the readout direction from images unless it is known. A note, or a warning if rows are
/// assumed because the images do not show it, is added to `result`.
Readout find_readout(const std::vector<std::filesystem::path>& images,
                     const std::optional<Readout>& known, const FrontendOptions& options,
                     const std::optional<std::array<int, 2>>& imager_px, Observations& result);

/// Throws InputError if no lamp has a frequency.
void check_frequencies(const LampMap& lamps, const std::filesystem::path& lamps_file);

/// Throws InputError if the map has none of the lamps in the captures.
void check_lamps(std::span<const Frame> frames, const LampMap& lamps,
                 const std::filesystem::path& lamps_file);

}  // namespace vlp
