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

/// How an image shows a step of light: with the standard deviation of its blur, and as
/// light^(1 / gamma).
struct StepPicture {
  double blur_px, gamma;
};

/// A piece of a rim that neighbouring lit lines cross: so far behind the outline, (column, row)
/// inwards.
struct RimPiece {
  Eigen::Vector2d inwards;
  double behind_px, sd_px;
};

struct RimSteps {
  std::vector<RimPiece> pieces;
  /// How many there may be, with and without a step that is clear.
  std::size_t looked_at;
  /// Where lines cross them; the level counts as their weight.
  std::vector<EdgePoint> points;
  /// The blur that most of them show.
  double blur_px;
};

/// The steps next to a light's outline. Of a piece, with the depth d of its pixels behind the
/// outline and t along it, u = d - x, the light is
///
///     exp(c t) (exp(o + p u + p^2 s^2 / 2) F(-u / s - p s) + exp(i + q u + q^2 s^2 / 2)
///               F(u / s + q s)) + floor^gamma:
///
/// exp(o + p u) outside and exp(i + q u) inside, levels that rise on both sides, as a halo and a
/// source deep in a reflector make them, with a step at x between, up or down, blurred by s, above
/// what is dark; F the normal distribution. The levels are those of StepPicture, because half of a
/// coded level is not half of the light: the larger the step, the further out it seems
/// (lib/THEORY.md). A clipped pixel tells only that its light is no less. The blur is fitted, too,
/// unless `blur_known`.
RimSteps fit_rim_steps(const ImageView& image, const Light& light,
                       const std::vector<int>& lit_lines, const Background& background,
                       const StepPicture& picture, bool blur_known, const LightShape& shape);

/// How far an outline is off, (column, row), by pieces of it, and its covariance.
struct OutlineShift {
  Eigen::Vector2d px;
  Matrix2 covariance;
  /// How many pieces agree.
  double agreeing;
};

/// By least squares (Tukey's biweight) with the outline's size and, unless it is `round` behind the
/// lens, how oval it is, unknown as well. What pieces scatter beyond what they state, all state too
/// little. Nothing when they are too few.
std::optional<OutlineShift> shift_of(const std::vector<RimPiece>& pieces, bool round);

}  // namespace vlp
