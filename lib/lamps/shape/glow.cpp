// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/glow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "lamps/shape/glow_envelope.h"
#include "lamps/shape/profile.h"

namespace vlp {
namespace {

/// The level of a row: the mean over the middle third of its run.
template <typename Level>
double level_of(const Level* row, const Run& run) {
  const int begin = run.begin + run.width() / 3, end = run.end - run.width() / 3;
  double sum = 0;
  for (int i = begin; i < end; ++i) sum += row[i];
  return sum / (end - begin);
}

/// Of each row of a blob from its top on, above the dark.
template <typename Level>
std::vector<double> levels_of(const ImageView& image, const Blob& blob, double dark) {
  std::vector<double> levels(static_cast<std::size_t>(blob.bottom() - blob.top() + 1));
  for (const Run& run : blob.runs) {
    double& level = levels[static_cast<std::size_t>(run.row - blob.top())];
    level = std::max(level, level_of(image.row<Level>(run.row), run) - dark);
  }
  return levels;
}

template <typename Level>
std::vector<EdgePoint> outline(const ImageView& image, const Blob& blob,
                               const Background& background, double share) {
  constexpr double least_lit = 0.6, steep = 1.3;
  constexpr int outside = -3;
  const auto levels = levels_of<Level>(image, blob, background.level);
  const auto envelope = envelope_of(levels);
  const double level = std::max(share * *std::max_element(envelope.begin(), envelope.end()),
                                2 * (background.threshold - background.level));
  std::vector<EdgePoint> points;
  for (const Run& run : blob.runs) {
    const auto index = static_cast<std::size_t>(run.row - blob.top());
    const double own = levels[index], lit = own / envelope[index];
    if (!(lit >= least_lit) || envelope[index] < steep * level) continue;
    const double at = background.level + lit * level;
    const auto* row = image.row<Level>(run.row);
    for (const int direction : {1, -1}) {
      const Profile<Level> profile{row, image.width, direction > 0 ? run.begin : run.end - 1,
                                   direction};
      const auto edge = profile.crossing(at, outside, run.width());
      if (!edge) continue;
      const auto low = profile.crossing(background.level + own / 4, outside, run.width());
      const auto high = profile.crossing(background.level + 3 * own / 4, outside, run.width());
      const double rise_px = low && high ? *high - *low : run.width();
      points.push_back(
          {{profile.edge + direction * *edge, run.row}, level, rise_px, direction > 0});
    }
  }
  return outermost(std::move(points));
}

std::vector<EdgePoint> outline_at(const ImageView& image, const Blob& blob,
                                  const Background& background, double share) {
  return visit_levels(
      image, [&](auto level) { return outline<decltype(level)>(image, blob, background, share); });
}

}  // namespace

std::optional<Light> glow_of(const ImageView& image, const Blob& blob, const Background& background,
                             const LightShape& shape) {
  constexpr std::array shares = {0.1, 0.15, 0.2, 0.125, 0.175};  // the last two for want of others
  constexpr std::size_t enough = 3;
  constexpr double least_shrinking = 0.1;  // of the outline, from a tenth of the level to a fifth
  constexpr double softest_edge = 0.15;    // of the radius
  std::map<double, Light> glows;           // by share
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const double share : shares) {
    if (glows.size() == enough) break;
    auto light = shape.light_of(outline_at(image, blob, background, share), background);
    if (!light) continue;
    if (!(light->rise_px > softest_edge * light->radius_px)) return std::nullopt;
    mean += light->pixel;
    glows.emplace(share, std::move(*light));
  }
  if (glows.size() < enough) return std::nullopt;
  auto& [least_share, result] = *glows.begin();
  double least_px = result.radius_px;
  for (const auto& [share, glow] : glows) least_px = std::min(least_px, glow.radius_px);
  const double of_a_fifth = std::log(glows.rbegin()->first / least_share) / std::log(2);
  if (result.radius_px < (1 + least_shrinking * of_a_fifth) * least_px) return std::nullopt;
  mean /= double(glows.size());
  double variance = 0;
  for (const auto& [share, glow] : glows) {
    variance +=
        (std::pow(glow.sigma_px, 2) + (glow.pixel - mean).squaredNorm() / 2) / double(glows.size());
  }
  result.low += mean - result.pixel;
  result.high += mean - result.pixel;
  result.pixel = mean;
  result.sigma_px = std::sqrt(variance);
  result.glows = true;
  return std::move(result);
}

}  // namespace vlp
