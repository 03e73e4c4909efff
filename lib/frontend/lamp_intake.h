// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "captures/captures_table.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "geometry/frames.h"
#include "lamps/light_detector.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Rotations level_from_camera of images, by name; std::nullopt if unknown
/// (LightDetector::copy_for_tilt()).
using LevelRotations = std::map<std::string, std::optional<Eigen::Matrix3d>>;

/// Computes the rotation level_from_camera from the inclination of a robot.
///
/// @param inclination       roll and pitch about the axes of the robot
/// @param yaw_in_robot_rad  yaw of the camera relative to the robot
/// @param base_from_camera  rotation by the calibrated tilt of the camera
/// @return                  rotation with an arbitrary yaw; a detector uses only its zenith
///     direction
Eigen::Matrix3d compute_level_rotation(const Inclination& inclination, double yaw_in_robot_rad,
                                       const Eigen::Matrix3d& base_from_camera);

/// Returns the level rotations of the images whose inclination is in the table.
LevelRotations compute_level_rotations(const CapturesTable& captures,
                                       const Calibration& calibration, double yaw_in_robot_rad);

/// Function that detects the lights of an image in the plane that is level by a rotation;
/// std::nullopt: by ellipses in the image.
using LightsInPlane = std::function<std::vector<Light>(const std::optional<Eigen::Matrix3d>&)>;
/// Function that replaces the lights of the named image by those of a repeated detection, as in the
/// level plane of its fix. Threads call it.
using DetectionRepetition = std::function<std::vector<Light>(
    const std::string& image, std::vector<Light> lights, const LightsInPlane& detect)>;

/// Images of lamps with the lamp map and the camera.
struct LampImages {
  /// Path of a folder of images, or of a video.
  std::filesystem::path images;
  LampMap lamps;
  std::filesystem::path lamps_file;
  /// Calibration of the camera. Without it, centers are those of ellipses in the image.
  std::optional<Calibration> calibration = {};
  std::filesystem::path calibration_file = {};
  /// Inclinations of the images; used if there is a calibration. std::nullopt: captures.csv in the
  /// folder.
  std::optional<CapturesTable> captures = {};
  /// Yaw of the camera in the frame of the robot's inclinations.
  double yaw_in_robot_rad = 0;
};

/// Detector of lamps in images, which rejects images that their use does not permit. Safe to share
/// between threads.
class LampIntake {
 public:
  /// Creates an intake from a detector.
  ///
  /// @param imager_px  size of the camera's images, if known
  /// @param levels     rotations of images whose camera is tilted differently from the detector's
  LampIntake(LightDetector detector, ImageUse use, const FrontendOptions& options,
             const std::optional<std::array<int, 2>>& imager_px, LevelRotations levels = {});

  /// Creates the intake of a set of images: reads the classifier and estimates the readout
  /// direction if it is not known. detect_lamps_in_images() returns its notes and warnings,
  /// too.
  /// @throws InputError if the row time, the frequencies or images are missing, or if captures.csv
  ///     cannot be read; also if the classifier is for other lamps or another row time
  LampIntake(const LampImages& images, ImageUse use, const FrontendOptions& options);

  /// Detects the lamps of an image. Rejects the image if it is unreadable, of another size, too
  /// dark, overexposed, or shows fewer lamps than its use needs. Repeated images are not rejected
  /// here, see Selection.
  /// @throws InputError if an annotated image cannot be written
  Observation detect_lamps_in_image(const SourceImage& source) const;

  /// Applies `repetition` to the lights of each image.
  void set_detection_repetition(DetectionRepetition repetition) {
    repetition_ = std::move(repetition);
  }

  /// Applies detect_lamps_in_image() to all images and video frames. Returns one observation per
  /// image, in order.
  Observations detect_lamps_in_images(const std::vector<std::filesystem::path>& files,
                                      const IntakeProgress& progress = {}) const;

  Readout readout_direction() const { return detector_.readout_direction(); }

 private:
  /// Notes and warnings about the set of images.
  Observations remarks_;
  LevelRotations levels_;
  LightDetector detector_;
  ImageUse use_;
  FrontendOptions options_;
  std::optional<std::array<int, 2>> imager_px_;
  DetectionRepetition repetition_;
  /// True if an image may be read out in the other direction
  /// (detect_both_readouts()).
  bool can_turn_ = false;
};

/// Returns the image files of a folder, or the video.
std::vector<std::filesystem::path> list_lamp_images(const std::filesystem::path& images);

/// Detects the lamps in a set of images (LampIntake) and rejects repeated images (Selection). Warns
/// of lamps in the map that are hard to distinguish. Sets Observations::failure if no lamp is
/// identified or no image can be used.
/// @throws InputError as LampIntake, and if no image can be read
Observations detect_lamps(const LampImages& images, ImageUse use, const FrontendOptions& options,
                          const IntakeProgress& progress = {});

/// Sets Observations::failure if no lamp is identified in any image, or no image is kept.
/// @throws InputError if no image can be read
void check_any_identified(const LampImages& images, const FrontendOptions& options,
                          Observations& result);

/// Estimates the readout direction from images unless it is known. Adds a note to `result`, or a
/// warning if the images do not determine it and rows are assumed.
Readout estimate_readout(const std::vector<std::filesystem::path>& images,
                         const std::optional<Readout>& known, const FrontendOptions& options,
                         const std::optional<std::array<int, 2>>& imager_px, Observations& result);

/// Describes a readout direction that the stripes in the images contradict, in one line; empty if
/// they do not.
/// @param given   readout direction with which the lamps were not identified
/// @param source  file or option that gives it, for the message
std::string describe_wrong_readout(const std::vector<std::filesystem::path>& images, Readout given,
                                   const std::string& source, const FrontendOptions& options,
                                   const std::optional<std::array<int, 2>>& imager_px);

/// Checks the frequencies of a lamp map.
/// @throws InputError if no lamp has a frequency
void check_frequencies(const LampMap& lamps, const std::filesystem::path& lamps_file);

/// Checks that a lamp map belongs to captures.
/// @throws InputError if the map has none of the lamps in the captures
void check_map_has_lamps(std::span<const Frame> frames, const LampMap& lamps,
                         const std::filesystem::path& lamps_file);

}  // namespace vlp
