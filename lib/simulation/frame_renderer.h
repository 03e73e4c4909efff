// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "simulation/board_print.h"
#include "simulation/pixel_rays.h"
#include "simulation/point_spread.h"
#include "simulation/shot.h"

namespace vlp {

/// Renders the light that a scene's camera collects: the mean number of electrons of each pixel.
/// - A pixel integrates over its area (add_shape_to_image()) and over its exposure. Line i is
///   exposed around Shutter::line_center_s(i), from the pose of the camera at that time.
///   Exposures during which something in view moves by more than 0.1 px are sums of several shorter
///   ones.
/// - A board is blurred at twice the resolution, before pixels integrate (add_shape_to_image()).
/// - Mirrors (Clutter::mirrors) show lights by rays that are reflected at the plane of the pane.
/// - The light of a lamp is first blurred by the lens, then switched at each line's exposure time,
///   as with a rolling shutter.
///
/// Const; may be shared between threads.
class FrameRenderer {
 public:
  /// Creates a renderer of the camera of `scene`, which must outlive the renderer. Computes the
  /// rays of all pixels.
  /// @throws std::invalid_argument if make_board_pattern() rejects the board
  explicit FrameRenderer(const Scene& scene);

  /// Returns electrons per pixel, as lines x places (PixelRays).
  cv::Mat1f render_lamps(const LampShot& shot) const;
  cv::Mat1f render_board(const BoardShot& shot) const;

  const PixelRays& pixel_rays() const { return rays_; }
  Shutter make_rolling_shutter(double exposure_s) const {
    return {*scene_.camera.row_time_s, exposure_s, rays_.num_readout_lines()};
  }

 private:
  cv::Mat1f integrate_electrons(const cv::Mat1f& electrons_per_s, double exposure_s) const;

  const Scene& scene_;
  PixelRays rays_;
  PointSpread optics_;
  /// Vignetting and dust on the lens, 0 to 1.
  cv::Mat1f transmission_;
  std::optional<BoardPattern> pattern_;
};

}  // namespace vlp
