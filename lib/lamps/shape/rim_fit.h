// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "geometry/types.h"
#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"

namespace vlp {

/// Model of a step of light in an image: standard deviation of its blur, and level =
/// light^(1 / gamma).
struct StepPicture {
  double blur_px, gamma;
};

/// A piece of a rim that neighbouring lit lines cross, its distance behind the outline, and the
/// direction inwards, (column, line).
struct RimPiece {
  Eigen::Vector2d inwards;
  double behind_px, sd_px;
};

struct RimSteps {
  std::vector<RimPiece> pieces;
  /// Number of pieces with and without a clear step.
  std::size_t looked_at;
  /// Points where lines cross them; the level is their weight.
  std::vector<EdgePoint> points;
  /// Median blur.
  double blur_px;
};

/// Fits the steps next to a light's outline. With the depth d of the pixels of a piece behind the
/// outline and t along it, u = d - x, the light is
///
///     exp(c t) (exp(o + p u + p^2 s^2 / 2) F(-u / s - p s) + exp(i + q u + q^2 s^2 / 2)
///               F(u / s + q s)) + floor^gamma:
///
/// exp(o + p u) outside and exp(i + q u) inside are levels that rise on both sides, as with a halo
/// and a source deep in a reflector. Between them is a step at x, up or down, blurred by s, above
/// the dark floor; F is the normal distribution. The levels are those of StepPicture, because half
/// of a coded level is not half of the light: the larger the step, the further out it seems
/// (lib/THEORY.md). A clipped pixel is a lower bound of its light. The blur is fitted, too, unless
/// `blur_known`.
RimSteps fit_rim_steps(const ImageView& image, const Light& light,
                       const std::vector<int>& lit_lines, const Background& background,
                       const StepPicture& picture, bool blur_known, const LightShape& shape);

/// Offset of an outline, (column, line), estimated from pieces of it, and its covariance.
struct OutlineShift {
  Eigen::Vector2d px;
  Matrix2 covariance;
  /// Number of pieces that agree.
  double agreeing;
};

/// Estimates the offset of an outline by least squares (Tukey's biweight). Its size is unknown,
/// too, and its oval unless it is `round` behind the lens. If pieces scatter by more than their
/// standard deviations, these are scaled. Returns std::nullopt if there are too few pieces.
std::optional<OutlineShift> shift_of(const std::vector<RimPiece>& pieces, bool round);

}  // namespace vlp
