// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "rig/calibration.h"
#include "simulation/frame_renderer.h"
#include "simulation/shot.h"

namespace vlp {

/// A lamp as a capture shows it.
struct TrueLamp {
  int id;
  /// Where the centre of the disc or rectangle is seen, each line of the image at its own time.
  Eigen::Vector2d pixel;
  /// The share of it that is in the image and not hidden, of some 200 points spread over it.
  double in_view;
};

/// The lamps that are at least partly in view and whose centre the lens describes, though it may
/// lie outside the image.
std::vector<TrueLamp> true_lamps(const Scene& scene, const FrameRenderer& renderer,
                                 const LampShot& shot);

enum class OtherLightKind {
  mirror_image,  ///< a lamp of the map, shown by a mirror
  pwm,           ///< a foreign light that a square wave dims
  mains          ///< a foreign light on the mains
};

/// Returns the kind as in true_other_lights.csv: "mirror_image", "pwm", "mains".
std::string_view name_of(OtherLightKind kind);

/// A light that flickers and is none of the lamps, as a capture shows it.
struct TrueOtherLight {
  OtherLightKind kind;
  /// The lamp of a mirror image.
  std::optional<int> lamp;
  /// Image of its centre; see TrueLamp.
  Eigen::Vector2d pixel;
  /// Share of it that is in the image, not hidden and, of a mirror image, within the pane.
  double in_view;
};

/// Mirror images and foreign lights that are at least partly in view and whose centre the lens
/// describes.
std::vector<TrueOtherLight> true_other_lights(const Scene& scene, const FrameRenderer& renderer,
                                              const LampShot& shot);

/// A corner of a tag's black border as a capture shows it, see BoardTag for the order; of a board
/// of squares, without a tag, one in which they touch, counted as square_corners_m() does.
struct TrueCorner {
  std::optional<int> tag;
  int corner;
  Eigen::Vector2d pixel;
};

/// The corners in the image.
std::vector<TrueCorner> true_corners(const Scene& scene, const FrameRenderer& renderer,
                                     const BoardShot& shot);

/// The scene's camera, with its tilt as the rotation centre.
Calibration true_calibration(const Scene& scene);

/// The lamps as the lamp map has them, or (`surveyed` false) as they are.
LampMap lamp_map_of(const Scene& scene, bool surveyed);

/// Writes into `folder`: of lamps truth.csv, true_detections.csv (with the share in view),
/// captures.csv and, of a scene with mirrors or foreign lights, true_other_lights.csv; of boards
/// true_boards.csv (camera_from_board as a place in metres and a rotation vector in radians) and
/// true_corners.csv. Returns how many captures show no lamp, or no corner. Throws InputError.
std::size_t write_truth(const Scene& scene, const FrameRenderer& renderer, const CaptureSet& set,
                        const std::filesystem::path& folder);

}  // namespace vlp
