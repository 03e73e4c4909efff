// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/frame_renderer.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vlp {
namespace {

/// How far the point spread reaches; less than 1e-4 of the light is beyond.
int reach_px(double blur_px) { return static_cast<int>(std::ceil(4 * blur_px)); }

cv::Mat1f vignetting_of(const PixelRays& rays, double power) {
  cv::Mat1f image(rays.lines(), rays.places());
  for (int line = 0; line < rays.lines(); ++line) {
    for (int place = 0; place < rays.places(); ++place) {
      const Eigen::Vector3d ray =
          rays.corner(line, place).normalized() + rays.corner(line, place + 1).normalized() +
          rays.corner(line + 1, place).normalized() + rays.corner(line + 1, place + 1).normalized();
      const double cosine = ray.normalized().z();
      image(line, place) = cosine > 0 ? static_cast<float>(std::pow(cosine, power)) : 0;
    }
  }
  return image;
}

}  // namespace

void blur(cv::Mat1f& image, double sigma_px) {
  if (sigma_px == 0) return;
  const int size = 2 * reach_px(sigma_px) + 1;
  cv::GaussianBlur(image, image, {size, size}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
}

FrameRenderer::FrameRenderer(const Scene& scene)
    : scene_(scene),
      rays_(scene.camera, reach_px(scene.optics.blur_px)),
      vignetting_(vignetting_of(rays_, scene.optics.vignetting_power)) {
  if (scene.board) print_.emplace(*scene.board);
}

cv::Mat1f FrameRenderer::collected(const cv::Mat1f& electrons_per_s, double exposure_s) const {
  return cv::Mat1f(rays_.without_margin(electrons_per_s).mul(vignetting_, exposure_s));
}

}  // namespace vlp
