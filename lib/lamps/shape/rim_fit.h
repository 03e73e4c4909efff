// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "geometry/types.h"
#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"

namespace vlp {

/// Imaging model of a step of light: standard deviation of the blur, and the tone curve level =
/// light^(1 / gamma).
struct StepImageModel {
  double blur_px, gamma;
};

/// Piece of a rim that neighboring scanlines cross, with the step of light found there.
/// `inward_normal` is the unit normal (column, line) towards the center. `step_depth_px` is the
/// distance of the step from the outline, px, positive inwards; `sd_px` is its standard deviation.
struct RimPiece {
  Eigen::Vector2d inward_normal;
  double step_depth_px, sd_px;
};

/// Result of fit_brightness_steps_at_rim().
struct RimSteps {
  std::vector<RimPiece> pieces;
  /// Number of examined pieces, with or without a clear step.
  std::size_t num_examined;
  /// Points where scanlines cross the pieces; EdgePoint::level is their weight.
  std::vector<EdgePoint> points;
  /// Weighted mean of the fitted log blurs; the given blur if it is known.
  double blur_px;
};

/// Fits the steps next to a light's outline. With the depth d of a pixel of a piece behind the
/// outline, t along it and u = d - x, the light is
///
///     exp(c t) (exp(o + p u + p^2 s^2 / 2) F(-u / s - p s) + exp(i + q u + q^2 s^2 / 2)
///               F(u / s + q s)) + floor^gamma.
///
/// The levels exp(o + p u) outside and exp(i + q u) inside may rise on both sides. Examples are a
/// halo and a source deep in a reflector. Between them is a step at x, up or down, blurred by s,
/// above the dark floor; F is the normal distribution. StepImageModel converts light to levels,
/// because half of a coded level is not half of the light: the larger the step, the further out it
/// appears (lib/THEORY.md). A clipped pixel is a lower bound of its light. The blur is also fitted
/// unless `blur_known`.
RimSteps fit_brightness_steps_at_rim(const ImageView& image, const Light& light,
                                     const std::vector<int>& lit_lines,
                                     const Background& background,
                                     const StepImageModel& image_model, bool blur_known,
                                     const LightShape& shape);

/// Offset of an outline, (column, line), estimated from its pieces, and its covariance.
struct OutlineOffset {
  Eigen::Vector2d offset_px;
  Matrix2 covariance;
  /// Sum of the weights of the pieces, about the number of inliers.
  double num_inliers;
};

/// Estimates the offset of an outline by robust least squares (Tukey's biweight). Also estimates
/// its change of size, and its ovality unless the outline is `round` in the plane of LightShape. If
/// the scatter of the pieces exceeds their standard deviations, these are scaled. Returns
/// std::nullopt if there are too few pieces.
std::optional<OutlineOffset> estimate_outline_offset(const std::vector<RimPiece>& pieces,
                                                     bool round);

}  // namespace vlp
