// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rim.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "lamps/signal/period_fit.h"

namespace vlp {
namespace {

/// Ellipse |unit_from_pixel (p - center)| = 1, (column, row).
struct Ellipse {
  Eigen::Vector2d center;
  Matrix2 unit_from_pixel;

  /// Columns where a scanline crosses the ellipse, and the relative height of the scanline: 0 in
  /// the middle, 1 if the scanline is tangent.
  struct Crossing {
    double begin, end, height;
  };
  /// Returns the crossing with a scanline; std::nullopt if there is none.
  std::optional<Crossing> intersect(double line) const {
    const Eigen::Vector2d d_column = unit_from_pixel.col(0);
    const Eigen::Vector2d at_line = unit_from_pixel.col(1) * (line - center.y());
    // |d_column u + at_line|^2 = 1
    const double a = d_column.squaredNorm(), b = d_column.dot(at_line);
    const double determinant = d_column.x() * at_line.y() - d_column.y() * at_line.x();
    const double square = determinant * determinant / a;
    if (!(square < 1)) return std::nullopt;
    const double half = std::sqrt((1 - square) / a), middle = center.x() - b / a;
    return Crossing{middle - half, middle + half, std::sqrt(square)};
  }
};

/// Returns the derivative of the level plane with respect to (column, row) at a pixel; std::nullopt
/// if the lens does not cover it.
std::optional<Matrix2> compute_plane_from_pixel(const LightShape& shape,
                                                const Eigen::Vector2d& pixel) {
  constexpr double step_px = 1;
  Matrix2 derivative;
  const auto at = shape.plane_from_pixel(shape.swap_axes(pixel));
  for (int i = 0; i < 2; ++i) {
    const auto beside =
        shape.plane_from_pixel(shape.swap_axes(pixel + step_px * Eigen::Vector2d::Unit(i)));
    if (!at || !beside) return std::nullopt;
    derivative.col(i) = (*beside - *at) / step_px;
  }
  return derivative;
}

/// Returns the shape of a blob, scaled to an area of pi, from the second moments of its pixels:
/// unit_from_pixel of the ellipse with these moments. Returns std::nullopt if it is nearly round.
std::optional<Matrix2> compute_blob_shape(const Blob& blob) {
  constexpr double min_axis_ratio = 1.15;
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Matrix2 squares = Matrix2::Zero();
  for (const PixelRun& run : blob.runs) {
    const double width = run.pixel_run_width_px();
    const Eigen::Vector2d middle((run.begin + run.end - 1) / 2.0, run.row);
    count += width;
    sum += width * middle;
    squares += width * middle * middle.transpose();
    squares(0, 0) += width * (width * width - 1) / 12;
  }
  const Matrix2 covariance = squares / count - sum * sum.transpose() / (count * count);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes{Eigen::Matrix2d(covariance)};
  const Eigen::Vector2d& variances = axes.eigenvalues();
  if (!(variances[0] > 0) || variances[1] < min_axis_ratio * min_axis_ratio * variances[0])
    return std::nullopt;
  return Matrix2(axes.operatorInverseSqrt() * std::sqrt(std::sqrt(variances.prod())));
}

/// Ellipse in the image, and the sum of e over its crossings with lit scanlines.
struct Ring {
  Ellipse ellipse;
  double sum;
};

/// Range of the radius of a ring, in pixels.
struct RadiusRange {
  double min_px, max_px;
};

/// Levels above the dark level in the box of a light with a margin.
class Face {
 public:
  /// Computes means over `window` pixels of a scanline.
  Face(const ImageView& image, const PixelBox& box, const Background& background, int window,
       double period_lines)
      : box_(box), window_(window) {
    constexpr double fraction = 0.02;
    const auto dark = static_cast<float>(background.level);
    levels_.reserve(std::size_t(box.area_px()));
    for (int row = box.y; row < box.end_row(); ++row) {
      for (int column = box.x; column < box.end_column(); ++column) {
        levels_.push_back(static_cast<float>(image.gray_level_at_pixel(column, row)) - dark);
      }
    }
    const double brightest = *std::max_element(levels_.begin(), levels_.end());
    soft_ = std::max(fraction * brightest, (background.threshold - background.level) / 2);
    compute_moving_means();
    fill_bright_scanlines(background.threshold - background.level, period_lines);
  }

  const PixelBox& box() const { return box_; }
  /// Returns the scanlines of bright stripes.
  const std::vector<int>& bright_scanlines() const { return lit_; }
  /// Returns the median of the bright levels of these scanlines, above the dark level.
  double bright_level() const { return bright_level_; }
  bool has(int column) const {
    return column >= box_.x + window_ && column + window_ <= box_.end_column();
  }

  /// Returns the mean levels before and after the border between a column and the previous one.
  std::pair<double, double> around(int line, int column) const {
    return {mean(line, column - 1), mean(line, column + window_ - 1)};
  }

  /// Returns e without limits for a light that begins, or ends, at this border; 0 at the border of
  /// the box.
  double step(int line, int column, bool begins) const {
    if (!has(column)) return 0;
    const auto [before, after] = around(line, column);
    const double outside = begins ? before : after, inside = begins ? after : before;
    const int further = column - 1 + (begins ? 2 : -1) * window_;
    const double beyond = mean(line, std::clamp(further, box_.x, box_.end_column() - 1));
    const double ratio = (inside + soft_) / (outside + soft_);
    const double slope = std::max(1.0, (beyond + soft_) / (inside + soft_));
    return std::log(ratio / slope);
  }

 private:
  std::size_t index(int line, int column) const {
    return std::size_t(line - box_.y) * std::size_t(box_.width) + std::size_t(column - box_.x);
  }
  /// Returns the mean level over the window that ends with a pixel; 0 if it is darker than dark.
  double mean(int line, int column) const { return std::max(0.F, means_[index(line, column)]); }

  /// Computes the mean over a window that ends with each pixel. Before the first pixel the level of
  /// the first pixel is used.
  void compute_moving_means() {
    means_.reserve(levels_.size());
    for (int row = box_.y; row < box_.end_row(); ++row) {
      const float* line = levels_.data() + index(row, box_.x);
      double sum = double(line[0]) * window_;
      for (int column = 0; column < box_.width; ++column) {
        sum += double(line[column]) - line[std::max(0, column - window_)];
        means_.push_back(static_cast<float>(sum * (1.0 / window_)));
      }
    }
  }

  /// Finds the scanlines in the brighter half of the period. Compares phases, because next to a
  /// bright core the bright stripes of the rim are darker than the core is in a dark stripe.
  void fill_bright_scanlines(double min_level, double period_lines) {
    LineProfile profile{double(box_.y), 1, {}};
    std::vector<double> brightest, lit_levels;
    std::vector<float> line;
    for (int row = 0; row < box_.height; ++row) {
      const auto begin = levels_.begin() + std::ptrdiff_t(index(box_.y + row, box_.x));
      line.assign(begin, begin + box_.width);
      double sum = 0;
      for (const float level : line) sum += std::sqrt(std::max(0.F, level));
      profile.levels.push_back(sum);
      const auto tenth = line.end() - 1 - std::ptrdiff_t(line.size() / 10);
      std::nth_element(line.begin(), tenth, line.end());
      brightest.push_back(*tenth);
    }
    const PeriodFit fit = fit_periodic_signal(profile, period_lines);
    const bool has_stripes = fit.depth > 0;
    for (int row = 0; row < box_.height; ++row) {
      const double phase_rad = 2 * std::numbers::pi * (box_.y + row) / period_lines - fit.phase_rad;
      const double level = brightest[static_cast<std::size_t>(row)];
      if (level < min_level || (has_stripes && std::cos(phase_rad) < 0)) continue;
      lit_.push_back(box_.y + row);
      lit_levels.push_back(level);
    }
    if (!lit_levels.empty()) bright_level_ = upper_median(std::move(lit_levels));
  }

  PixelBox box_;
  int window_;
  double soft_, bright_level_ = 0;
  std::vector<float> levels_, means_;  // row by row
  std::vector<int> lit_;
};

/// Steps e, up to `max_step`, of a subset of the lit scanlines at each border, for a light that
/// begins there and for one that ends there.
class Steps {
 public:
  Steps(const Face& face, double max_step) : left_(face.box().x), width_(face.box().width) {
    constexpr std::size_t max_lines = 48;
    const std::vector<int>& lit = face.bright_scanlines();
    every_ = (lit.size() + max_lines - 1) / max_lines;
    for (std::size_t i = 0; i < lit.size(); i += every_) {
      lines_.push_back(lit[i]);
      for (int border = 0; border < width_; ++border) {
        for (const bool begins : {true, false}) {
          e_.push_back(std::clamp(face.step(lit[i], left_ + border, begins), -0.7, max_step));
        }
      }
    }
    fill_limits();
  }

  /// Returns the sum of e over the crossings of an ellipse with the lit scanlines, scaled to all of
  /// them; -infinity if it cannot be above `best`.
  double sum_steps(const Ellipse& ellipse, double best) const {
    constexpr double max_height = 0.94;  // scanlines are nearly tangent above it
    const double min_sum = best / double(every_);
    double sum = 0;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (sum + limits_[i] < min_sum) return -std::numeric_limits<double>::infinity();
      const auto crossing = ellipse.intersect(lines_[i]);
      if (!crossing || crossing->height > max_height) continue;
      sum += at(i, crossing->begin, 0) + at(i, crossing->end, 1);
    }
    return sum * double(every_);
  }

 private:
  double at(std::size_t line, double u, std::size_t end) const {
    const int border = static_cast<int>(std::floor(u + 1)) - left_;  // border i is at i - 0.5
    if (border < 0 || border >= width_) return 0;
    return e_[2 * (line * static_cast<std::size_t>(width_) + static_cast<std::size_t>(border)) +
              end];
  }

  /// Computes the largest possible sums of e over each line and the lines below it.
  void fill_limits() {
    limits_.assign(lines_.size() + 1, 0);
    for (std::size_t line = lines_.size(); line-- > 0;) {
      std::array<double, 2> largest{};
      for (std::size_t i = 0; i < 2 * static_cast<std::size_t>(width_); ++i) {
        double& e = largest[i % 2];
        e = std::max(e, e_[2 * line * static_cast<std::size_t>(width_) + i]);
      }
      limits_[line] = limits_[line + 1] + largest[0] + largest[1];
    }
  }

  int left_, width_;
  std::size_t every_;
  std::vector<int> lines_;
  std::vector<double> e_, limits_;
};

/// Returns the ring with the largest sum. Rings are circles in the level plane, whose derivative is
/// `unit_plane_from_pixel`.
Ring select_ring(const Face& face, const PixelBox& blob, const Matrix2& unit_plane_from_pixel,
                 const RadiusRange& range, double max_step) {
  constexpr double fine = 20, max_shift = 0.35;
  const Steps steps(face, max_step);
  const double size = std::max(blob.width, blob.height),
               step = std::max(1.0, std::min(size / 2, range.max_px) / fine);
  const Eigen::Vector2d middle(blob.x + blob.width / 2.0, blob.y + blob.height / 2.0);
  Ring best{{middle, unit_plane_from_pixel}, -std::numeric_limits<double>::infinity()};
  const auto search = [&](const RadiusRange& radii, double max_shift_px) {
    for (double radius = radii.min_px; radius <= radii.max_px; radius += step) {
      const Matrix2 unit_from_pixel = unit_plane_from_pixel / radius;
      for (double dv = -max_shift_px; dv <= max_shift_px; dv += step) {
        for (double du = -max_shift_px; du <= max_shift_px; du += step) {
          const Ellipse ellipse{middle + Eigen::Vector2d(du, dv), unit_from_pixel};
          const double sum = steps.sum_steps(ellipse, best.sum);
          if (sum > best.sum) best = {ellipse, sum};
        }
      }
    }
  };
  // A ring near the border of the blob is probable. Its sum excludes most others quickly.
  search({std::max(range.min_px, size / 2 - 2 * step), std::min(range.max_px, size / 2)}, 2 * step);
  search(range, max_shift * size);
  return best;
}

}  // namespace

std::optional<MeasuredLight> fit_rim_of_light(const ImageView& image, const Blob& blob,
                                              double period_lines, const Background& background,
                                              const LightShape& shape,
                                              const std::optional<KnownRadius>& radius) {
  constexpr int min_size = 8, min_lines = 5;
  constexpr double margin = 0.2, min_step = 0.28, min_known_step = 0.1, max_radius = 0.75,
                   max_sds = 2;
  constexpr double min_start_blur_px = 1.5, start_blur = 0.04, max_center_sd = 0.006,
                   max_known_center_sd = 0.01;
  const PixelBox box = blob.blob_bounding_box();
  if (std::min(box.width, box.height) < min_size) return std::nullopt;
  const Eigen::Vector2d middle(box.x + box.width / 2.0, box.y + box.height / 2.0);
  const auto plane_from_pixel = compute_plane_from_pixel(shape, middle);
  if (!plane_from_pixel) return std::nullopt;
  const double plane_per_px = std::sqrt(std::abs(plane_from_pixel->determinant()));
  const double blob_size = std::max(box.width, box.height);
  const int margin_px = static_cast<int>(margin * blob_size);
  const PixelBox wide = expand_and_clip_box(box, margin_px, image.size());
  RadiusRange range{blob_size / 6, max_radius * blob_size};
  if (radius) {
    const double radius_px = radius->radius / plane_per_px,
                 factor = std::exp(max_sds * radius->log_sd);
    range = {std::max(range.min_px, radius_px / factor),
             std::min(range.max_px, radius_px * factor)};
  }
  const int size = std::max(wide.width, wide.height),
            window = std::max(std::clamp(size / 30, 2, 6), size / 50);
  const Face face(image, wide, background, window, period_lines);
  if (face.bright_scanlines().size() < min_lines) return std::nullopt;
  // Without a lens the axis ratio of a disc is unknown.
  constexpr double min_oval_gain = 1.2;
  Matrix2 unit_from_pixel = *plane_from_pixel / plane_per_px;
  // The steps of a bright core must not exceed those of a dim rim of known radius.
  const double max_step = radius ? 0.5 : 1;
  Ring best = select_ring(face, box, unit_from_pixel, range, max_step);
  const auto blob_shape = shape.has_known_lens() ? std::nullopt : compute_blob_shape(blob);
  if (blob_shape) {
    const Ring oval = select_ring(face, box, *blob_shape, range, max_step);
    if (oval.sum > min_oval_gain * best.sum) {
      best = oval;
      unit_from_pixel = *blob_shape;
    }
  }
  const auto crossings =
      2 * std::count_if(face.bright_scanlines().begin(), face.bright_scanlines().end(),
                        [&](int line) { return best.ellipse.intersect(line).has_value(); });
  if (!(best.sum > (radius ? min_known_step : min_step) * double(crossings))) return std::nullopt;

  const auto center = shape.plane_from_pixel(shape.swap_axes(best.ellipse.center));
  if (!center) return std::nullopt;
  const double ring_radius_px = 1 / std::sqrt(std::abs(best.ellipse.unit_from_pixel.determinant()));
  const auto fit = fit_disc_outline(
      image, {*center, unit_from_pixel * plane_from_pixel->inverse() / ring_radius_px},
      std::max(min_start_blur_px, start_blur * ring_radius_px), period_lines, background, shape,
      radius);
  constexpr double min_core_ratio = 2;
  MeasuredLight light{};
  light.has_bright_core = fit && face.bright_level() > min_core_ratio * fit->level;
  if (!fit || fit->center_sd_px > (radius ? max_known_center_sd : max_center_sd) * fit->radius_px ||
      !set_fitted_outline(*fit, shape, light) || (radius && !radius->is_radius_of(light))) {
    return std::nullopt;
  }
  return light;
}

}  // namespace vlp
