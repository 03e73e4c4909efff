// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <opencv2/core.hpp>

#include "simulation/frame_renderer.h"
#include "simulation/scene.h"

namespace vlp {

/// A scene with nothing that blurs, weakens or disturbs: one lamp of even brightness that is always
/// on, seen by a level camera. Tests add what they are about.
Scene plain_scene();

/// The lenses of the scenes in datasets, and a stereographic one.
Camera paper_rig_camera();
Camera wide_camera();
Camera stereographic_camera();
/// No distortion, f = 500 px, the centre in the middle.
Camera pinhole_camera();

/// The camera at rest; the lamps of the scene are lit from time 0 with phase 0.
LampShot shot_at(const Scene& scene, const Eigen::Vector3d& position_m, double yaw_rad);

/// A board of 6 x 5 tags with gaps as wide as a tag, white 1e6 and black 0 e/s on white.
SceneBoard plain_board();
/// So many views of the scene's board.
CaptureSet board_views(int count, double distance_m, double tilt_rad, double roll_rad,
                       double spread);

/// The sum of the light, and its centroid (u, v), over all pixels.
struct Brightness {
  double sum;
  Eigen::Vector2d centroid_px;
};
Brightness brightness_of(const cv::Mat1f& image);

}  // namespace vlp
