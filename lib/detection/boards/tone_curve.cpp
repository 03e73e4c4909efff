// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tone_curve.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vlp {
namespace {

/// Parabola through values at three successive entries of kGammas from `first` on, as a function of
/// x = log(gamma).
struct Parabola {
  std::size_t first;

  double x(std::size_t i) const { return std::log(kGammas[first + i]); }

  /// Returns the weights of the three values at an x (Lagrange interpolation).
  std::array<double, 3> weights(double at) const {
    std::array<double, 3> weights{1, 1, 1};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (k != i) weights[i] *= (at - x(k)) / (x(i) - x(k));
      }
    }
    return weights;
  }

  /// Returns the x of the minimum between both ends.
  double locate_minimum(const std::array<double, 3>& values) const {
    const double low = (values[1] - values[0]) / (x(1) - x(0));
    const double high = (values[2] - values[1]) / (x(2) - x(1));
    if (high <= low) return values[0] <= values[2] ? x(0) : x(2);
    const double middle = (x(0) + x(1)) / 2 - low * (x(2) - x(0)) / (2 * (high - low));
    return std::clamp(middle, x(0), x(2));
  }
};

/// Returns the parabola through the smallest cost and its neighbors.
Parabola make_parabola(const ValuesPerGamma& costs) {
  const auto best =
      static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  return {std::clamp<std::size_t>(best, 1, kGammas.size() - 2) - 1};
}

double estimate_log_gamma(const ValuesPerGamma& costs) {
  const Parabola parabola = make_parabola(costs);
  return parabola.locate_minimum(
      {costs[parabola.first], costs[parabola.first + 1], costs[parabola.first + 2]});
}

/// Interpolates between the steps behind two curves; unknown if one of them is.
EdgeStep interpolate_step(const EdgeStep& below, const EdgeStep& above, double fraction) {
  if (!(below.blur_px > 0 && above.blur_px > 0)) return {};
  const auto mix = [&](double a, double b) { return (1 - fraction) * a + fraction * b; };
  return {mix(below.blur_px, above.blur_px), mix(below.dark, above.dark),
          mix(below.bright, above.bright)};
}

}  // namespace

ValuesPerGamma sum_tone_curve_costs(const std::vector<BoardView>& views) {
  constexpr double max_cost = 1000;
  ValuesPerGamma sums{};
  for (const BoardView& view : views) {
    const auto& costs = view.detection.curve_costs;
    if (costs.empty()) continue;
    const double best = *std::min_element(costs.begin(), costs.end());
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += std::min(costs[std::min(i, costs.size() - 1)] - best, max_cost);
    }
  }
  return sums;
}

double estimate_gamma(const ValuesPerGamma& costs) { return std::exp(estimate_log_gamma(costs)); }

double correct_views_for_tone_curve(std::vector<BoardView>& views, const ValuesPerGamma& costs) {
  constexpr double min_gamma = 1.2;
  const Parabola parabola = make_parabola(costs);
  const double log_gamma = estimate_log_gamma(costs);
  const bool is_linear = log_gamma < std::log(min_gamma);
  const auto weights = parabola.weights(log_gamma);
  const std::size_t lower = log_gamma < parabola.x(1) ? 0 : 1, below = parabola.first + lower;
  const double fraction =
      (log_gamma - parabola.x(lower)) / (parabola.x(lower + 1) - parabola.x(lower));
  for (BoardView& view : views) {
    view.detection.curve_costs.clear();
    for (TagDetection& tag : view.detection.tags) {
      std::vector<TagDetection::Outline> fits{
          {tag.corners_px, tag.curvatures, tag.corner_sds_px, tag.steps}};
      fits.insert(fits.end(), tag.tone_curve_fits.begin(), tag.tone_curve_fits.end());
      tag.tone_curve_fits.clear();
      if (is_linear || fits.size() < kGammas.size()) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        tag.corners_px[k].setZero();
        tag.curvatures[k].quadratic_px = tag.curvatures[k].cubic_px = 0;
        // Linear interpolation, because a parabola can become negative.
        const double below_px = fits[below].corner_sds_px[k],
                     above_px = fits[below + 1].corner_sds_px[k];
        const bool known = below_px > 0 && above_px > 0;
        tag.corner_sds_px[k] = known ? (1 - fraction) * below_px + fraction * above_px : 0;
        tag.steps[k] = interpolate_step(fits[below].steps[k], fits[below + 1].steps[k], fraction);
        for (std::size_t i = 0; i < 3; ++i) {
          const TagDetection::Corners& corners_px = fits[parabola.first + i].corners_px;
          const TagDetection::Curvatures& curvatures = fits[parabola.first + i].curvatures;
          tag.corners_px[k] += weights[i] * corners_px[k];
          tag.curvatures[k].quadratic_px += weights[i] * curvatures[k].quadratic_px;
          tag.curvatures[k].cubic_px += weights[i] * curvatures[k].cubic_px;
        }
      }
    }
  }
  return is_linear ? 1 : std::exp(log_gamma);
}

}  // namespace vlp
