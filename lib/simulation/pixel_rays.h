// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "camera/lens.h"
#include "rig/calibration.h"

namespace vlp {

/// The rays through the corners of a camera's pixels, looked up once. Pixels are addressed as the
/// shutter reads them: by line (a row of the image, or a column for Readout::columns) and by
/// place in the line. Around the image there is a margin of pixels whose light only blur brings in.
class PixelRays {
 public:
  PixelRays(const Camera& camera, int margin_px);

  const Lens& lens() const { return lens_; }
  Readout readout() const { return readout_; }
  /// Of the image, without the margin.
  int lines() const { return lines_; }
  int places() const { return places_; }
  int margin_px() const { return margin_px_; }

  /// The corner between the pixels (line - 1, place - 1) and (line, place), for line and place
  /// from -margin to count + margin; in camera, of any length. NaN where the lens has no ray.
  const Eigen::Vector3d& corner(int line, int place) const {
    return corners_[static_cast<std::size_t>(line + margin_px_) * stride_ +
                    static_cast<std::size_t>(place + margin_px_)];
  }

  /// (line, place) of a pixel (u, v), which may lie between pixel centres.
  Eigen::Vector2d line_and_place(const Eigen::Vector2d& pixel) const {
    return readout_ == Readout::rows ? Eigen::Vector2d(pixel.y(), pixel.x()) : pixel;
  }

  /// An image of these pixels, lines x places, with the margin all around.
  cv::Mat1f image(float value) const {
    return cv::Mat1f(lines_ + 2 * margin_px_, places_ + 2 * margin_px_, value);
  }
  /// The part without the margin.
  cv::Mat1f without_margin(const cv::Mat1f& image) const {
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
