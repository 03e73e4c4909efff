// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/calibration.h"
#include "simulation/frame_renderer.h"
#include "simulation/shot.h"

namespace vlp {

/// Lamp as it appears in a capture.
struct TrueLamp {
  int id;
  /// Pixel (u, v) of the lamp's center, with the camera at its pose when the line of that pixel is
  /// exposed.
  Eigen::Vector2d pixel;
  /// Fraction of the lamp that is inside the image and not hidden, from some 200 points spread over
  /// it.
  double visible_fraction;
};

/// Returns the lamps that are at least partly in view and whose center the lens describes. The
/// center may lie outside the image.
std::vector<TrueLamp> list_true_lamps(const Scene& scene, const FrameRenderer& renderer,
                                      const LampShot& shot);

/// Flickering light that is not one of the lamps, as it appears in a capture.
struct TrueOtherLight {
  /// "mirror_image" (of a lamp of the map), or a foreign light: "pwm" (dimmed by a square wave),
  /// "mains".
  std::string kind;
  /// Lamp id of a mirror image.
  std::optional<int> lamp;
  /// Pixel (u, v) of the light's center, as in TrueLamp.
  Eigen::Vector2d pixel;
  /// Fraction of the light that is inside the image, not hidden and, for a mirror image, within the
  /// pane.
  double visible_fraction;
};

/// Returns the mirror images and foreign lights that are at least partly in view and whose center
/// the lens describes.
std::vector<TrueOtherLight> list_true_lights(const Scene& scene, const FrameRenderer& renderer,
                                             const LampShot& shot);

/// Corner of a tag's black border as it appears in a capture, in the order of BoardTag. For a board
/// of squares without tags: an inner corner, numbered as in list_inner_corners_m().
struct TrueCorner {
  std::optional<int> tag;
  int corner;
  Eigen::Vector2d pixel;
};

/// Returns the corners inside the image.
std::vector<TrueCorner> list_true_corners(const Scene& scene, const FrameRenderer& renderer,
                                          const BoardShot& shot);

/// Returns the scene's camera, with its tilt as the rotation center.
Calibration make_true_calibration(const Scene& scene);

/// Returns the lamp map with map errors (`surveyed` true), or with the true positions.
LampMap make_lamp_map(const Scene& scene, bool surveyed);

/// Writes the ground truth of a set into `folder`.
///   Lamps: truth.csv, true_detections.csv (with the fraction in view), captures.csv and, for a
///   scene with mirrors or foreign lights, true_other_lights.csv.
///   Boards: true_corners.csv and true_boards.csv (camera_from_board as a position in meters
///   and a rotation vector in radians).
/// Returns the number of captures without a lamp, or without a corner, in view.
/// @throws InputError if a file cannot be written
std::size_t write_truth_tables(const Scene& scene, const FrameRenderer& renderer,
                               const CaptureSet& set, const std::filesystem::path& folder);

}  // namespace vlp
