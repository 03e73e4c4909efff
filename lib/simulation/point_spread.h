// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "simulation/pixel_rays.h"
#include "simulation/scene.h"

namespace vlp {

/// Returns the radius of the point spread of the optics, px: less than 1e-3 of the light falls
/// outside. The veil is not included, as it extends over the whole image.
int compute_blur_radius_px(const Optics& optics);

/// Position and resolution of a part of the camera's image that is to be blurred. The part is in
/// readout order: lines x places.
struct SpreadWindow {
  /// Line and place of its first pixel.
  int line_begin, place_begin;
  /// Number of elements of the part per pixel along each axis.
  int per_px = 1;
};

/// Point spread of a scene's optics, which varies over the image:
///   - a Gaussian (Optics::blur_px), and a disc of defocus (Defocus), whose radius is interpolated
///     between discs of whole multiples of 0.5 px;
///   - a halo, a Gaussian into which a smear (LensSmear) scatters a fraction of the light;
///   - a veil (Optics::veiling_glare): a fraction of the light of the whole scene, spread evenly.
/// Edges are replicated outside the image.
class PointSpread {
 public:
  /// `optics` and `rays` outlive the object.
  PointSpread(const Optics& optics, const PixelRays& rays) : optics_(optics), rays_(rays) {}

  /// Applies everything except the veil.
  void apply_point_spread(cv::Mat1f& part, const SpreadWindow& window) const;

  /// Applies the veil to an image of the whole scene.
  void add_veiling_glare(cv::Mat1f& image) const;

  /// Removes the fraction scattered by the veil from the light of a part of the scene. Returns the
  /// amount that each pixel of the image receives of it.
  float extract_glare(cv::Mat1f& part) const;

 private:
  void apply_defocus_blur(cv::Mat1f& part, const SpreadWindow& window) const;
  void apply_lens_smear(const LensSmear& smear, cv::Mat1f& part, const SpreadWindow& window) const;

  const Optics& optics_;
  const PixelRays& rays_;
};

/// Returns the fraction of the light that passes the dust on the lens (Dust), as lines x places.
cv::Mat1f compute_transmission(const std::vector<Dust>& dust, const PixelRays& rays);

}  // namespace vlp
