// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "camera/lens.h"
#include "rig/calibration.h"

namespace vlp {

/// Table of the rays through the corners of a camera's pixels.
///
/// Pixels are addressed in readout order: by line (a row of the image, or a column for
/// Readout::columns) and by place in the line. A margin of pixels surrounds the image; their light
/// reaches the image only by blur.
class PixelRays {
 public:
  PixelRays(const Camera& camera, int margin_px);

  const Lens& camera_lens() const { return lens_; }
  Readout readout_direction() const { return readout_; }
  /// Number of lines of the image, without the margin: its height in pixels for Readout::rows, its
  /// width for Readout::columns.
  int num_readout_lines() const { return lines_; }
  int pixels_per_line() const { return places_; }
  /// Width of the margin on each side.
  int image_margin_px() const { return margin_px_; }

  /// Returns the ray through the common corner of the pixels (line - 1, place - 1) and (line,
  /// place), in the camera frame, not normalized. Valid for line and place from -margin to count +
  /// margin. NaN if the lens has no ray there.
  const Eigen::Vector3d& pixel_corner_ray(int line, int place) const {
    return corners_[static_cast<std::size_t>(line + margin_px_) * stride_ +
                    static_cast<std::size_t>(place + margin_px_)];
  }

  /// Returns (line, place) of a pixel (u, v), which need not be integer.
  Eigen::Vector2d to_readout_order(const Eigen::Vector2d& pixel) const {
    return readout_ == Readout::rows ? Eigen::Vector2d(pixel.y(), pixel.x()) : pixel;
  }

  /// Returns a constant image of lines x places with the margin all around.
  cv::Mat1f make_padded_image(float value) const {
    return cv::Mat1f(lines_ + 2 * margin_px_, places_ + 2 * margin_px_, value);
  }
  /// Returns the part of an image with margin that is inside the margin.
  cv::Mat1f crop_image_margin(const cv::Mat1f& image) const {
    return image(cv::Rect(margin_px_, margin_px_, places_, lines_));
  }

 private:
  Lens lens_;
  Readout readout_;
  int lines_, places_, margin_px_;
  std::size_t stride_;
  std::vector<Eigen::Vector3d> corners_;
};

}  // namespace vlp
