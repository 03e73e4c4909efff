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
  double least(const std::array<double, 3>& values) const {
    const double low = (values[1] - values[0]) / (x(1) - x(0));
    const double high = (values[2] - values[1]) / (x(2) - x(1));
    if (high <= low) return values[0] <= values[2] ? x(0) : x(2);
    const double middle = (x(0) + x(1)) / 2 - low * (x(2) - x(0)) / (2 * (high - low));
    return std::clamp(middle, x(0), x(2));
  }
};

/// Returns the parabola through the smallest cost and its neighbors.
Parabola near_least(const PerCurve& costs) {
  const auto best =
      static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  return {std::clamp<std::size_t>(best, 1, kGammas.size() - 2) - 1};
}

double least_log_gamma(const PerCurve& costs) {
  const Parabola near = near_least(costs);
  return near.least({costs[near.first], costs[near.first + 1], costs[near.first + 2]});
}

/// Interpolates between the steps behind two curves; unknown if one of them is.
EdgeStep between(const EdgeStep& below, const EdgeStep& above, double share) {
  if (!(below.blur_px > 0 && above.blur_px > 0)) return {};
  const auto mix = [&](double a, double b) { return (1 - share) * a + share * b; };
  return {mix(below.blur_px, above.blur_px), mix(below.dark, above.dark),
          mix(below.bright, above.bright)};
}

}  // namespace

PerCurve costs_of_levels(const std::vector<BoardView>& views) {
  constexpr double most = 1000;
  PerCurve sums{};
  for (const BoardView& view : views) {
    const auto& costs = view.seen.curve_costs;
    if (costs.empty()) continue;
    const double best = *std::min_element(costs.begin(), costs.end());
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += std::min(costs[std::min(i, costs.size() - 1)] - best, most);
    }
  }
  return sums;
}

double gamma_of(const PerCurve& costs) { return std::exp(least_log_gamma(costs)); }

double take_curve(std::vector<BoardView>& views, const PerCurve& costs) {
  constexpr double least_taken = 1.2;
  const Parabola near = near_least(costs);
  const double log_gamma = least_log_gamma(costs);
  const bool none = log_gamma < std::log(least_taken);
  const auto weights = near.weights(log_gamma);
  const std::size_t lower = log_gamma < near.x(1) ? 0 : 1, below = near.first + lower;
  const double share = (log_gamma - near.x(lower)) / (near.x(lower + 1) - near.x(lower));
  for (BoardView& view : views) {
    view.seen.curve_costs.clear();
    for (SeenTag& tag : view.seen.tags) {
      std::vector<SeenTag::Outline> behind{{tag.corners_px, tag.bows, tag.sds_px, tag.steps}};
      behind.insert(behind.end(), tag.behind_curves.begin(), tag.behind_curves.end());
      tag.behind_curves.clear();
      if (none || behind.size() < kGammas.size()) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        tag.corners_px[k].setZero();
        tag.bows[k].square_px = tag.bows[k].cube_px = 0;
        // Linear interpolation, because a parabola can become negative.
        const double below_px = behind[below].sds_px[k], above_px = behind[below + 1].sds_px[k];
        const bool known = below_px > 0 && above_px > 0;
        tag.sds_px[k] = known ? (1 - share) * below_px + share * above_px : 0;
        tag.steps[k] = between(behind[below].steps[k], behind[below + 1].steps[k], share);
        for (std::size_t i = 0; i < 3; ++i) {
          const SeenTag::Corners& corners_px = behind[near.first + i].corners_px;
          const SeenTag::Bows& bows = behind[near.first + i].bows;
          tag.corners_px[k] += weights[i] * corners_px[k];
          tag.bows[k].square_px += weights[i] * bows[k].square_px;
          tag.bows[k].cube_px += weights[i] * bows[k].cube_px;
        }
      }
    }
  }
  return none ? 1 : std::exp(log_gamma);
}

}  // namespace vlp
