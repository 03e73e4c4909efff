// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "geometry/median.h"
#include "geometry/normal_equations.h"

namespace vlp {
namespace {

/// Profile of a row from outside a light towards its inside: pixel i is in column `edge + direction
/// * i`.
struct Profile {
  const ImageView& image;
  int row, edge, direction;

  bool has(int i) const {
    const int column = edge + direction * i;
    return column >= 0 && column < image.width;
  }
  double operator()(int i) const { return image.gray_level_at_pixel(edge + direction * i, row); }

  /// Returns the first position from `begin` to before `end` where the profile rises through
  /// `level`; std::nullopt if there is none.
  std::optional<double> find_level_crossing(double level, int begin, int end) const {
    for (int i = begin; i < end && has(i) && has(i + 1); ++i) {
      const double below = (*this)(i), above = (*this)(i + 1);
      if (below < level && above >= level) return i + (level - below) / (above - below);
    }
    return std::nullopt;
  }
};

void add_edge(const Profile& profile, int width, double dark, std::vector<EdgePoint>& points) {
  constexpr int outside = -6, inside = 3, samples = 4;
  if (!profile.has(outside)) return;
  // Samples a few pixels of the light from 3 px inside on; further inside for soft edges, whose run
  // is wide.
  const auto level_at = [&](int first) {
    double sum = 0;
    for (int i = first; i < first + samples; ++i) sum += profile(i);
    return sum / samples - dark;
  };
  const int reach = width / 2;
  const auto rough = profile.find_level_crossing(dark + level_at(inside) / 2, outside, reach);
  if (!rough) return;
  const int first = std::min(static_cast<int>(*rough) + inside, width - samples);
  const double level = level_at(first);
  const auto at = profile.find_level_crossing(dark + level / 2, outside, reach);
  const auto low = profile.find_level_crossing(dark + level / 4, outside, reach);
  const auto high = profile.find_level_crossing(dark + 3 * level / 4, outside, reach);
  if (!at || level <= 0) return;
  const double rise_px = low && high ? *high - *low : reach;
  points.push_back({{profile.edge + profile.direction * *at, profile.row},
                    level,
                    rise_px,
                    profile.direction > 0});
}

/// Axis-aligned ellipse of a disc's rim in its box.
class RimEllipse {
 public:
  explicit RimEllipse(const DiscImage& disc)
      : disc_(disc),
        center_((disc.box_min + disc.box_max) / 2),
        half_((disc.box_max - disc.box_min) / 2) {}

  /// Returns the outward normal of the rim. @pre The point is near the rim.
  Eigen::Vector2d compute_outline_normal(const Eigen::Vector2d& point) const {
    return (point - center_).cwiseQuotient(half_.cwiseAbs2()).normalized();
  }
  /// Returns the radius of curvature at the point with this normal.
  double radius_px(const Eigen::Vector2d& normal) const {
    return std::pow(half_.prod(), 2) / std::pow(half_.cwiseProduct(normal).norm(), 3);
  }
  double chord_length_px(double row) const {
    const double up = (row - center_.y()) / half_.y();
    return 2 * half_.x() * std::sqrt(std::max(0.0, 1 - up * up));
  }
  /// Returns the distance from the image of the disc's center to the rim's first or last column.
  double compute_half_width_px(bool begins) const {
    return begins ? disc_.center.x() - disc_.box_min.x() : disc_.box_max.x() - disc_.center.x();
  }
  /// Returns the outward distance from the image of the disc's center.
  double distance_outwards_px(double column, bool begins) const {
    return begins ? disc_.center.x() - column : column - disc_.center.x();
  }

 private:
  DiscImage disc_;
  Eigen::Vector2d center_, half_;
};

/// Estimates the standard deviation of the blur across the rim from the rise of the levels. The
/// result is limited, because a slower rise may belong to the lamp itself.
double blur_px(const std::vector<EdgePoint>& points, const RimEllipse& rim) {
  constexpr double quarters = 1.349;  // of a normal distribution, in standard deviations
  constexpr double maximum = 1.5;
  std::vector<double> blurs;
  blurs.reserve(points.size());
  for (const EdgePoint& point : points) {
    blurs.push_back(point.rise_px * std::abs(rim.compute_outline_normal(point.pixel).x()) /
                    quarters);
  }
  return std::min(upper_median(std::move(blurs)), maximum);
}

/// Level of the light next to the edge in a row: a line fit to a few pixels further inside, because
/// lamps darken towards their rim, and the lens darkens towards the image border.
struct InnerLevel {
  EdgePoint point;
  Eigen::Vector2d normal;
  /// Column of pixel 0 of the inward profile.
  int origin;
  /// First pixel of the line fit in this profile, and the middle of its pixels.
  int first;
  double middle;
  /// Level at the middle above the dark level, and its change per pixel inwards.
  double level, slope;

  int edge_direction() const { return point.is_run_begin ? 1 : -1; }
  double normal_cosine() const { return std::abs(normal.x()); }
  double edge_column(double i) const { return origin + edge_direction() * i; }
};

constexpr int kBefore = 8, kSamples = 8;
/// Variance of the pixel positions of a line fit.
constexpr double kVariance = (kSamples * kSamples - 1) / 12.0;

Profile make_profile(const ImageView& image, const InnerLevel& inner) {
  return {image, static_cast<int>(inner.point.pixel.y()), inner.origin, inner.edge_direction()};
}

std::vector<InnerLevel> measure_inner_levels(const ImageView& image,
                                             const std::vector<EdgePoint>& points,
                                             const RimEllipse& rim, double dark) {
  constexpr double flattest = 0.35, depth_px = 3, max_relative_change = 0.35;
  constexpr double square = kSamples * (kSamples * kSamples - 1) / 12.0;
  std::vector<InnerLevel> result;
  result.reserve(points.size());
  for (const EdgePoint& point : points) {
    // Skips rows that cut the outline at a flat angle.
    InnerLevel inner{};
    inner.point = point;
    inner.normal = rim.compute_outline_normal(point.pixel);
    if (inner.normal_cosine() < flattest) continue;
    const double depth = depth_px / inner.normal_cosine();
    if (2 * depth + kSamples > rim.chord_length_px(point.pixel.y())) continue;
    inner.origin =
        static_cast<int>(std::lround(point.pixel.x())) - inner.edge_direction() * kBefore;
    inner.first = kBefore + static_cast<int>(std::lround(depth));
    inner.middle = inner.first + (kSamples - 1) / 2.0;
    const auto profile = make_profile(image, inner);
    if (!profile.has(0) || !profile.has(inner.first + kSamples)) continue;
    double sum = 0, moment = 0;
    for (int i = inner.first; i < inner.first + kSamples; ++i) {
      sum += profile(i);
      moment += (i - inner.middle) * profile(i);
    }
    inner.level = sum / kSamples - dark;
    inner.slope = moment / square;
    // An occluder further inside makes the line too steep.
    const double change = std::abs(inner.slope) * (inner.middle - kBefore);
    if (change < max_relative_change * inner.level) result.push_back(inner);
  }
  return result;
}

/// Fits the edge of a profile near `at` to all pixels there; `width` is the standard deviation of
/// the blur along the profile. See refine_disc_outline().
std::optional<double> find_blurred_edge(const Profile& profile, double at, double width,
                                        double level, double dark) {
  constexpr int num_iterations = 4;
  constexpr double reach = 3, min_reach_px = 2, further_in_px = 1, far = 2;
  const double reach_px =
      std::max(reach * width, min_reach_px);  // four unknowns need enough pixels
  const int begin = static_cast<int>(std::ceil(at - reach_px));
  const int end = static_cast<int>(std::floor(at + reach_px + further_in_px));
  if (!profile.has(begin) || !profile.has(end)) return std::nullopt;
  double edge = at, outside = 0, inside = level, slope = 0;
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    Normal<4> normal;
    for (int i = begin; i <= end; ++i) {
      const double t = i - edge, u = t / width;
      const double lit = std::erfc(-u / std::numbers::sqrt2) / 2;
      const double density = std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi);
      const double rise = t * lit + width * density;
      const double model = outside * (1 - lit) + inside * lit + slope * rise;
      const double d_level_d_edge = -(inside - outside) / width * density - slope * lit;
      normal.add_residual_row(std::array{d_level_d_edge, 1 - lit, lit, rise},
                              model + dark - profile(i));
    }
    const Cholesky<4> factor(normal);
    if (!factor.has_full_rank(1e-9)) return std::nullopt;
    const auto step = factor.solve_normal_equations(normal.gradient);
    edge -= step[0], outside -= step[1], inside -= step[2], slope -= step[3];
    if (!(std::abs(edge - at) < far * width)) return std::nullopt;
  }
  return edge;
}

/// Returns the curvature q of a light's level profile 1 + q (u / w)^2: u pixels along a row from
/// the image of the disc's center, w from there to the rim. It is negative if the light is darker
/// at its rim. It is the mean of the medians of both sides, so that a linear change across the
/// light has no effect. Returns 0 for a light that is too small for slopes away from the middle, or
/// if a side is hidden.
double estimate_curvature(const std::vector<InnerLevel>& levels, const RimEllipse& rim) {
  constexpr double min_u = 1 / 3.0;  // of w: nearer to the middle no slope shows the bend
  constexpr double maximum = 0.8;
  std::array<std::vector<double>, 2> curvatures;
  for (const InnerLevel& inner : levels) {
    const bool begins = inner.point.is_run_begin;
    const double width_px = rim.compute_half_width_px(begins);
    const double fraction =
        rim.distance_outwards_px(inner.edge_column(inner.middle), begins) / width_px;
    if (fraction < min_u) continue;
    curvatures[begins ? 0 : 1].push_back(-inner.slope * width_px / (2 * fraction * inner.level));
  }
  const std::size_t min_count = std::min(curvatures[0].size(), curvatures[1].size());
  const std::size_t max_count = std::max(curvatures[0].size(), curvatures[1].size());
  if (min_count == 0 || 2 * min_count < max_count) return 0;
  const double curvature =
      (upper_median(std::move(curvatures[0])) + upper_median(std::move(curvatures[1]))) / 2;
  return std::clamp(curvature, -maximum, maximum);
}

/// Returns true if the residuals of the curved line fits are correlated between neighboring pixels,
/// beyond chance and enough to move the outline. For pure noise the mean product of neighbors is
/// -1/4 of the mean square, because a line was fitted. With the n = 6 degrees of freedom of 8
/// pixels per line, its standard deviation is 1 / sqrt(n).
bool has_uneven_inner_levels(const ImageView& image, const std::vector<InnerLevel>& levels,
                             const RimEllipse& rim, double curvature, double dark) {
  constexpr double expected_correlation = -0.25, beyond_chance = 3.5, min_fraction = 0.003;
  constexpr int left = kSamples - 2;
  double squares = 0, products = 0, level_squares = 0;
  for (const InnerLevel& inner : levels) {
    const auto profile = make_profile(image, inner);
    const double quadratic =
        inner.level * curvature / std::pow(rim.compute_half_width_px(inner.point.is_run_begin), 2);
    double before = 0;
    for (int i = inner.first; i < inner.first + kSamples; ++i) {
      const double away = i - inner.middle;
      const double line = inner.level + inner.slope * away + quadratic * (away * away - kVariance);
      const double off = profile(i) - dark - line;
      squares += off * off;
      products += before * off;
      before = off;
    }
    level_squares += left * inner.level * inner.level;
  }
  const double beyond = products - expected_correlation * squares;
  const double count = left * double(levels.size());
  return beyond > beyond_chance / std::sqrt(count) * squares &&
         beyond > min_fraction * min_fraction * level_squares;
}

}  // namespace

RefinedOutline refine_disc_outline(const ImageView& image, const std::vector<EdgePoint>& points,
                                   const DiscImage& disc, const Background& background) {
  // With more blur its tail reaches the samples and is mistaken for curvature.
  constexpr double max_blur_to_bend_px = 1.3;
  // Variance that interpolation between pixels adds to the measured rises.
  constexpr double between_pixels = 1 / 8.0;
  constexpr double min_width_px = 0.4;
  if (points.empty()) return {};
  const double dark = background.level;
  const RimEllipse rim(disc);
  const double blur = blur_px(points, rim), square = blur * blur;
  const double square_across = std::max(0.0, square - between_pixels);
  const auto levels = measure_inner_levels(image, points, rim, dark);
  const bool inside_only = blur < max_blur_to_bend_px;
  const double curvature = inside_only ? estimate_curvature(levels, rim) : 0;
  RefinedOutline result{
      {}, inside_only && has_uneven_inner_levels(image, levels, rim, curvature, dark)};
  result.points.reserve(levels.size());
  for (const InnerLevel& inner : levels) {
    const bool begins = inner.point.is_run_begin;
    const double back = inner.middle - kBefore, width_px = rim.compute_half_width_px(begins);
    const double quadratic = curvature * (back * back - kVariance) / (width_px * width_px);
    const double level = inner.level * (1 + quadratic) - inner.slope * back;
    if (level <= 0) continue;
    const auto profile = make_profile(image, inner);
    const auto at = profile.find_level_crossing(dark + level / 2, 0, inner.first);
    if (!at) continue;
    // Slope of the lamp's own profile at its rim, inwards. Vignetting acts on levels that are
    // already blurred.
    const double rim_px = rim.distance_outwards_px(inner.edge_column(kBefore), begins);
    const double slope = -2 * curvature * inner.level * rim_px / (width_px * width_px);
    // Blur moves the half-level point outwards if the level increases inwards, and inwards at a
    // curved rim. For a standard deviation s of the blur across it and a radius r of the rim, the
    // displacements are s^2 slope / level and s^2 / (2 r), to first order.
    const double cosine = inner.normal_cosine();
    const double behind_bend = square_across / (2 * rim.radius_px(inner.normal) * cosine);
    double edge = *at + square * slope / (level * cosine * cosine) - behind_bend;
    if (result.is_mottled) {
      const double width = std::max(std::sqrt(square_across), min_width_px) / cosine;
      const auto fitted = find_blurred_edge(profile, *at, width, level, dark);
      if (!fitted) continue;
      edge = *fitted - behind_bend;
    }
    EdgePoint better = inner.point;
    better.pixel.x() = inner.edge_column(edge);
    better.level = level;
    result.points.push_back(better);
  }
  return result;
}

std::vector<EdgePoint> select_outermost_edge_points(std::vector<EdgePoint> points) {
  const auto further_out = [](const EdgePoint& a, const EdgePoint& b) {
    if (a.pixel.y() != b.pixel.y()) return a.pixel.y() < b.pixel.y();
    if (a.is_run_begin != b.is_run_begin) return a.is_run_begin;
    return a.is_run_begin ? a.pixel.x() < b.pixel.x() : a.pixel.x() > b.pixel.x();
  };
  const auto same_side = [](const EdgePoint& a, const EdgePoint& b) {
    return a.pixel.y() == b.pixel.y() && a.is_run_begin == b.is_run_begin;
  };
  std::sort(points.begin(), points.end(), further_out);
  points.erase(std::unique(points.begin(), points.end(), same_side), points.end());
  return points;
}

std::vector<EdgePoint> find_blob_outline(const ImageView& image, const Blob& blob,
                                         const Background& background) {
  constexpr int min_width = 8;
  std::vector<EdgePoint> points;
  points.reserve(2 * blob.runs.size());
  for (const PixelRun& run : blob.runs) {
    if (run.pixel_run_width_px() < min_width) continue;
    add_edge({image, run.row, run.begin, 1}, run.pixel_run_width_px(), background.level, points);
    add_edge({image, run.row, run.end - 1, -1}, run.pixel_run_width_px(), background.level, points);
  }
  // Between the stripes of a saturated lamp, spilled charge has no outline of its own.
  constexpr double min_fraction = 0.35;
  double brightest = 0;
  for (const EdgePoint& point : points) brightest = std::max(brightest, point.level);
  std::erase_if(points, [&](const EdgePoint& p) { return p.level < min_fraction * brightest; });
  return points;
}

}  // namespace vlp
