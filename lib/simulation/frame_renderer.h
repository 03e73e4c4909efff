// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "simulation/board_print.h"
#include "simulation/pixel_rays.h"
#include "simulation/point_spread.h"
#include "simulation/shot.h"
#include "simulation/shutter.h"

namespace vlp {

/// The light that a scene's camera collects: the mean number of electrons of each pixel.
///   - Each pixel integrates over its area (add_shape) and over its time: line i is exposed around
///     Shutter::center_s(i), from where the camera is then. An exposure during which something in
///     view moves by more than 0.1 px is the sum of several shorter ones.
///   - A board is blurred in halves of pixels, before those gather the light (add_shape_in_halves).
///   - Mirrors (Clutter::mirrors) show lights by rays that are reflected in the pane's plane.
///   - A lamp's light is blurred by the lens first and switched by each line's own time after, as a
///     rolling shutter sees it.
/// Const and safe to share between threads.
class FrameRenderer {
 public:
  /// The scene outlives it. Throws std::invalid_argument for a board that cannot be printed.
  explicit FrameRenderer(const Scene& scene);

  /// Lines x places (PixelRays).
  cv::Mat1f lamp_electrons(const LampShot& shot) const;
  cv::Mat1f board_electrons(const BoardShot& shot) const;

  const PixelRays& rays() const { return rays_; }
  Shutter shutter(double exposure_s) const {
    return {*scene_.camera.row_time_s, exposure_s, rays_.lines()};
  }

 private:
  cv::Mat1f collected(const cv::Mat1f& electrons_per_s, double exposure_s) const;

  const Scene& scene_;
  PixelRays rays_;
  PointSpread optics_;
  /// Vignetting, and the dust on the lens.
  cv::Mat1f transmission_;
  std::optional<BoardPrint> print_;
};

}  // namespace vlp
