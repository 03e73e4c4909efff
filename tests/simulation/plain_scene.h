// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <opencv2/core.hpp>

#include "simulation/frame_renderer.h"
#include "simulation/scene.h"

namespace vlp {

/// Returns a scene without blur, vignetting and noise: one uniformly bright lamp that is always on,
/// above a level camera. Tests add the properties they need.
Scene plain_scene();

/// Return the lenses of the scenes in datasets, and a stereographic one.
Camera paper_rig_camera();
Camera wide_camera();
Camera stereographic_camera();
/// Returns a camera without distortion, f = 500 px, the principal point at the image center.
Camera pinhole_camera();

/// Returns a capture of the camera at rest. The lamps of the scene are lit from time 0 with phase
/// 0.
LampShot shot_at(const Scene& scene, const Eigen::Vector3d& position_m, double yaw_rad);

/// Returns a board of 6 x 5 tags with gaps as wide as a tag, white 1e6 and black 0 e/s on white.
SceneBoard plain_board();
/// Returns a set with `count` views of the scene's board.
CaptureSet board_views(int count, double distance_m, double tilt_rad, double roll_rad,
                       double spread);

/// Sum of the light and its centroid (u, v), over all pixels.
struct Brightness {
  double sum;
  Eigen::Vector2d centroid_px;
};
Brightness measure_brightness(const cv::Mat1f& image);

}  // namespace vlp
