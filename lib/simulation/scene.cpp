// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

namespace vlp {
namespace {

void draw_hot_spots(cv::RNG random, Glow& glow) {
  if (!glow.random_chips) return;
  const RandomChips& chips = *glow.random_chips;
  const double radius_m = glow.glow_radius_m();
  glow.hot_spots.clear();
  for (int i = 0; i < chips.count; ++i) {
    const double angle = random.uniform(0.0, 2 * std::numbers::pi);
    const double distance_m =
        radius_m * chips.within_fraction * std::sqrt(random.uniform(0.0, 1.0));
    const double excess = random.uniform(chips.min_excess, chips.max_excess);
    glow.hot_spots.push_back({distance_m * Eigen::Vector2d(std::cos(angle), std::sin(angle)),
                              chips.sigma_fraction * radius_m, excess});
  }
}

/// Returns the strokes of a seven-segment digit as fractions of a letter's cell. x runs from left
/// to right, y from bottom to top.
const std::array<Eigen::AlignedBox2d, 7>& digit_strokes() {
  constexpr double left = 0.15, right = 0.75, bottom = 0.15, top = 0.85, stroke = 0.14;
  constexpr double middle = (bottom + top) / 2, half = stroke / 2;
  using Box = Eigen::AlignedBox2d;
  using Point = Eigen::Vector2d;
  static const std::array<Box, 7> strokes = {
      Box(Point(left, bottom), Point(right, bottom + stroke)),
      Box(Point(left, middle - half), Point(right, middle + half)),
      Box(Point(left, top - stroke), Point(right, top)),
      Box(Point(left, bottom), Point(left + stroke, middle)),
      Box(Point(left, middle), Point(left + stroke, top)),
      Box(Point(right - stroke, bottom), Point(right, middle)),
      Box(Point(right - stroke, middle), Point(right, top))};
  return strokes;
}

void draw_letters(cv::RNG random, Sign& sign) {
  const Eigen::Array2d cell(1.0 / sign.letters, 1.0 / sign.lines);
  sign.strokes.clear();
  for (int line = 0; line < sign.lines; ++line) {
    for (int letter = 0; letter < sign.letters; ++letter) {
      const int stroke_mask = random.uniform(1, 1 << 7);
      const Eigen::Array2d corner(letter, sign.lines - 1 - line);
      for (std::size_t stroke = 0; stroke < digit_strokes().size(); ++stroke) {
        if ((stroke_mask >> stroke & 1) == 0) continue;
        const Eigen::AlignedBox2d& box = digit_strokes()[stroke];
        sign.strokes.emplace_back(((corner + box.min().array()) * cell).matrix(),
                                  ((corner + box.max().array()) * cell).matrix());
      }
    }
  }
}

Eigen::Vector3d compute_normal(const Panel& pane) {
  return pane.edge_a_m.cross(pane.edge_b_m).normalized();
}

}  // namespace

cv::RNG make_generator(std::uint64_t seed, std::string_view name, std::size_t index) {
  std::vector<std::uint32_t> words{std::uint32_t(seed), std::uint32_t(seed >> 32),
                                   std::uint32_t(index), std::uint32_t(index >> 32)};
  words.insert(words.end(), name.begin(), name.end());
  std::seed_seq sequence(words.begin(), words.end());
  std::array<std::uint32_t, 2> state{};
  sequence.generate(state.begin(), state.end());
  return cv::RNG(state[0] | std::uint64_t(state[1]) << 32);
}

std::uint64_t draw_seed(cv::RNG& random) {
  const std::uint64_t high = random.next();
  return high << 32 | random.next();
}

double SquareWave::compute_mean_light_fraction(double begin_s, double end_s) const {
  const auto lit_periods_until = [&](double t_s) {
    const double periods = frequency_hz * t_s + phase;
    const double whole = std::floor(periods);
    return whole * duty + std::min(periods - whole, duty);
  };
  return (lit_periods_until(end_s) - lit_periods_until(begin_s)) /
         (frequency_hz * (end_s - begin_s));
}

double RectifiedSine::compute_mean_light_fraction(double begin_s, double end_s) const {
  // The integral of |sin(pi x)| from 0 to x grows by 2 / pi for each whole period.
  const auto integral_until = [&](double t_s) {
    const double periods = frequency_hz * t_s + phase;
    const double whole = std::floor(periods);
    return (2 * whole + 1 - std::cos(std::numbers::pi * (periods - whole))) / std::numbers::pi;
  };
  const double mean =
      (integral_until(end_s) - integral_until(begin_s)) / (frequency_hz * (end_s - begin_s));
  return 1 - depth + depth * mean;
}

LightWave copy_with_phase(LightWave wave, double phase) {
  std::visit([&](auto& each) { each.phase = phase; }, wave);
  return wave;
}

void draw_random_parts(Scene& scene) {
  const auto random = [&](std::string_view name, std::size_t index) {
    return make_generator(scene.seed, name, index);
  };
  for (SceneLamp& lamp : scene.lamps) {
    draw_hot_spots(random("chips of a lamp", static_cast<std::size_t>(lamp.id)), lamp.glow);
  }
  Clutter& clutter = scene.clutter;
  for (std::size_t i = 0; i < clutter.steady_lamps.size(); ++i) {
    draw_hot_spots(random("chips of a steady lamp", i), clutter.steady_lamps[i]);
  }
  for (std::size_t i = 0; i < clutter.foreign_lights.size(); ++i) {
    draw_hot_spots(random("chips of a foreign light", i), clutter.foreign_lights[i].glow);
  }
  for (std::size_t i = 0; i < clutter.signs.size(); ++i) {
    draw_letters(random("sign", i), clutter.signs[i]);
  }
}

Eigen::Isometry3d make_reflection_transform(const Panel& pane) {
  const Eigen::Vector3d normal = compute_normal(pane);
  Eigen::Isometry3d reflection;
  reflection.linear() = Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose();
  reflection.translation() = 2 * normal.dot(pane.corner_m) * normal;
  return reflection;
}

bool are_on_same_side(const Mirror& mirror, const Eigen::Vector3d& light_m,
                      const Eigen::Vector3d& eye_m) {
  const Eigen::Vector3d normal = compute_normal(mirror.pane);
  return normal.dot(light_m - mirror.pane.corner_m) * normal.dot(eye_m - mirror.pane.corner_m) > 0;
}

}  // namespace vlp
