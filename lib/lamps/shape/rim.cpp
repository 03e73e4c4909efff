// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "lamps/shape/rim_fit.h"

namespace vlp {
namespace {

/// In pixels of a box.
struct Ring {
  double u, v, radius;
  /// Of e over its crossings with lit lines.
  double sum;
};

/// The box of a light and a margin around it, above the dark.
class Face {
 public:
  /// Means are of so many pixels.
  Face(const ImageView& image, const PixelBox& box, const Background& background, int window)
      : box_(box), window_(window) {
    constexpr double share = 0.02;
    const auto dark = static_cast<float>(background.level);
    levels_.reserve(std::size_t(box.area()));
    for (int row = box.y; row < box.bottom(); ++row) {
      for (int column = box.x; column < box.right(); ++column) {
        levels_.push_back(static_cast<float>(image.level_at(column, row)) - dark);
      }
    }
    const double brightest = *std::max_element(levels_.begin(), levels_.end());
    soft_ = std::max(share * brightest, (background.threshold - background.level) / 2);
    find_means();
    find_lit_lines(background.threshold - background.level);
  }

  const PixelBox& box() const { return box_; }
  /// Lines of bright stripes.
  const std::vector<int>& lit_lines() const { return lit_; }
  std::vector<int> lit_lines_of_image() const {
    std::vector<int> lines = lit_;
    for (int& line : lines) line += box_.y;
    return lines;
  }
  bool has(int column) const { return column >= window_ && column + window_ <= box_.width; }

  /// Mean level before the border between a column and the one before it, and after it.
  std::pair<double, double> around(int line, int column) const {
    const float* line_means = means(line);
    return {std::max(0.F, line_means[column - 1]), std::max(0.F, line_means[column + window_ - 1])};
  }

  /// e, unbounded, of a light that begins at that border, or ends there; 0 at the box's edge.
  double step(int line, int column, bool begins) const {
    if (!has(column)) return 0;
    const auto [before, after] = around(line, column);
    const double outside = begins ? before : after, inside = begins ? after : before;
    const int further = std::clamp(column - 1 + (begins ? 2 : -1) * window_, 0, box_.width - 1);
    const double beyond = std::max(0.F, means(line)[further]);
    const double ratio = (inside + soft_) / (outside + soft_);
    const double slope = std::max(1.0, (beyond + soft_) / (inside + soft_));
    return std::log(ratio / slope);
  }

  /// Where a line passes that share of the way between the levels on both sides of that border,
  /// next to it.
  std::optional<double> passage(int line, int column, double share) const {
    const auto [before, after] = around(line, column);
    const auto [dark, bright] = std::minmax(before, after);
    const double middle = dark + share * (bright - dark), sign = after > before ? 1 : -1;
    const float* levels = this->levels(line);
    const double border = column - 0.5;
    std::optional<double> nearest;
    for (int i = column - window_; i + 1 < column + window_; ++i) {
      const double from = sign * (levels[i] - middle), to = sign * (levels[i + 1] - middle);
      if (!(from < 0 && to >= 0)) continue;
      const double at = i - from / (to - from);
      if (!nearest || std::abs(at - border) < std::abs(*nearest - border)) nearest = at;
    }
    return nearest;
  }

 private:
  const float* levels(int line) const { return levels_.data() + std::ptrdiff_t(line) * box_.width; }
  const float* means(int line) const { return means_.data() + std::ptrdiff_t(line) * box_.width; }

  /// Computes the mean over a window that ends with each pixel; before the first pixel the line has
  /// its level.
  void find_means() {
    means_.reserve(levels_.size());
    for (int row = 0; row < box_.height; ++row) {
      const float* line = levels(row);
      double sum = double(line[0]) * window_;
      for (int column = 0; column < box_.width; ++column) {
        sum += double(line[column]) - line[std::max(0, column - window_)];
        means_.push_back(static_cast<float>(sum * (1.0 / window_)));
      }
    }
  }

  void find_lit_lines(double least_level) {
    constexpr double least_lit = 0.55;
    std::vector<double> brightest(static_cast<std::size_t>(box_.height));
    std::vector<float> line;
    for (int row = 0; row < box_.height; ++row) {
      line.assign(levels(row), levels(row) + box_.width);
      const auto tenth = line.end() - 1 - std::ptrdiff_t(line.size() / 10);
      std::nth_element(line.begin(), tenth, line.end());
      brightest[static_cast<std::size_t>(row)] = *tenth;
    }
    const int near = std::max(8, box_.height / 10);
    for (int row = 0; row < box_.height; ++row) {
      const auto begin = brightest.begin() + std::max(0, row - near);
      const auto end = brightest.begin() + std::min(box_.height, row + near + 1);
      const double level = brightest[static_cast<std::size_t>(row)];
      if (level > least_level && level > least_lit * *std::max_element(begin, end)) {
        lit_.push_back(row);
      }
    }
  }

  PixelBox box_;
  int window_;
  double soft_;
  std::vector<float> levels_, means_;  // row by row
  std::vector<int> lit_;
};

/// Of some of the lit lines e at each border, for a light that begins there and for one that ends.
class Steps {
 public:
  explicit Steps(const Face& face) : width_(face.box().width) {
    constexpr std::size_t most_lines = 48;
    const std::vector<int>& lit = face.lit_lines();
    every_ = (lit.size() + most_lines - 1) / most_lines;
    for (std::size_t i = 0; i < lit.size(); i += every_) {
      lines_.push_back(lit[i]);
      for (int border = 0; border < width_; ++border) {
        for (const bool begins : {true, false}) {
          e_.push_back(std::clamp(face.step(lit[i], border, begins), -0.7, 1.0));
        }
      }
    }
  }

  /// Over all lit lines.
  double sum_of(double u, double v, double radius) const {
    constexpr double steepest = 0.94;  // where lines still cross the circle
    double sum = 0;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const double off = lines_[i] - v;
      if (std::abs(off) > steepest * radius) continue;
      const double half = std::sqrt(radius * radius - off * off);
      sum += at(i, u - half, 0) + at(i, u + half, 1);
    }
    return sum * double(every_);
  }

 private:
  double at(std::size_t line, double u, std::size_t end) const {
    const int border = static_cast<int>(std::floor(u + 1));  // border i is at i - 0.5
    if (border < 0 || border >= width_) return 0;
    return e_[2 * (line * static_cast<std::size_t>(width_) + static_cast<std::size_t>(border)) +
              end];
  }

  int width_;
  std::size_t every_;
  std::vector<int> lines_;
  std::vector<double> e_;
};

/// The rings of the largest sum: the best, and the best of those that are far from it.
std::array<Ring, 2> best_rings(const Face& face, const PixelBox& blob) {
  constexpr double fine = 20, far = 0.15;
  const Steps steps(face);
  const double size = std::max(blob.width, blob.height), step = std::max(1.0, size / 2 / fine);
  const double u0 = blob.x - face.box().x + blob.width / 2.0;
  const double v0 = blob.y - face.box().y + blob.height / 2.0;
  std::vector<Ring> rings;
  for (double radius = size / 6; radius <= 0.6 * size; radius += step) {
    for (double dv = -size / 4; dv <= size / 4; dv += step) {
      for (double du = -size / 4; du <= size / 4; du += step) {
        const double u = u0 + du, v = v0 + dv;
        rings.push_back({u, v, radius, steps.sum_of(u, v, radius)});
      }
    }
  }
  const auto less = [](const Ring& a, const Ring& b) { return a.sum < b.sum; };
  const Ring best = *std::max_element(rings.begin(), rings.end(), less);
  std::erase_if(rings, [&](const Ring& ring) {
    const double away = std::hypot(ring.u - best.u, ring.v - best.v, ring.radius - best.radius);
    return away < far * size;
  });
  const auto other = std::max_element(rings.begin(), rings.end(), less);
  return {best, other == rings.end() ? Ring{best.u, best.v, best.radius, 0} : *other};
}

/// The clearest steps near an ellipse in the box from `low` to `high`, in the image.
std::vector<EdgePoint> steps_near(const Face& face, const Eigen::Vector2d& low,
                                  const Eigen::Vector2d& high, double reach_px) {
  constexpr double least_step = 0.35, flattest = 0.3;
  const Eigen::Vector2d center = (low + high) / 2, half = (high - low) / 2;
  std::vector<EdgePoint> points;
  std::vector<double> levels;
  for (const int line : face.lit_lines()) {
    const double up = (line + face.box().y - center.y()) / half.y();
    if (std::abs(up) >= 1) continue;
    const double across = std::sqrt(1 - up * up);
    const double cosine = across / half.x() / std::hypot(across / half.x(), up / half.y());
    if (cosine < flattest) continue;
    for (const bool begins : {true, false}) {
      const double at = center.x() + (begins ? -1 : 1) * across * half.x() - face.box().x + 0.5;
      const double reach = reach_px / std::max(cosine, 0.5);
      double best = least_step;
      std::optional<int> border;
      for (int i = static_cast<int>(std::ceil(at - reach)); i <= at + reach; ++i) {
        const double step = face.step(line, i, begins);
        if (step > best) best = step, border = i;
      }
      if (!border) continue;
      const auto at_half = face.passage(line, *border, 0.5);
      const auto low_end = face.passage(line, *border, 0.25);
      const auto high_end = face.passage(line, *border, 0.75);
      if (!at_half || !low_end || !high_end) continue;
      const auto [before, after] = face.around(line, *border);
      levels.push_back(std::max(before, after));
      points.push_back({{*at_half + face.box().x, line + face.box().y},
                        0,
                        std::abs(*high_end - *low_end),
                        begins});
    }
  }
  // All weigh the same: a dim part of the rim is as good as a bright one.
  if (!levels.empty()) {
    const double level = upper_median(std::move(levels));
    for (EdgePoint& point : points) point.level = level;
  }
  return points;
}

/// What one line of ten reaches in the middle of its runs or half way to their ends, above the
/// dark.
template <typename Level>
double bright_level(const ImageView& image, const Blob& blob, double dark) {
  std::vector<Level> levels;
  levels.reserve(blob.runs.size());
  for (const Run& run : blob.runs) {
    const auto* row = image.row<Level>(run.row) + run.begin;
    const std::ptrdiff_t quarter = run.width() / 4;
    levels.push_back(std::max({row[quarter], row[2 * quarter], row[3 * quarter]}));
  }
  const auto tenth = levels.begin() + std::ptrdiff_t(levels.size() * 9 / 10);
  std::nth_element(levels.begin(), tenth, levels.end());
  return *tenth - dark;
}

/// How many points err together: those of a stripe, whose lines follow one another.
double points_of_a_stripe(const std::vector<EdgePoint>& outline) {
  constexpr double next = 2.5;
  std::array<double, 2> last{-1e9, -1e9};
  double stripes = 0;
  for (const EdgePoint& point : outline) {
    double& row = last[point.begins ? 0 : 1];
    if (point.pixel.y() - row > next) ++stripes;
    row = point.pixel.y();
  }
  return double(outline.size()) / std::max(1.0, stripes);
}

/// The light by the steps next to its outline, in which sides of another contrast are as far out as
/// others, and the sigma of its centre; whether most of them show one.
bool fit_to_steps(const ImageView& image, const std::vector<int>& lit_lines,
                  const Background& background, const LightShape& shape, Light& light,
                  double& sigma_px) {
  constexpr int rounds = 3;
  constexpr double first_blur_px = 0.9, most = 0.6;
  // Cameras for people code light^(1 / 2.2), nearly, and those that do not have hardly the depth to
  // show a rim; give or take, which the centre by another one tells.
  constexpr double gamma = 2, other_gamma = 1.8;
  StepPicture picture{first_blur_px, gamma};
  for (int round = 1; round < rounds; ++round) {
    auto steps = fit_rim_steps(image, light, lit_lines, background, picture, round > 1, shape);
    if (!shift_of(steps.pieces, shape.has_lens())) return false;
    picture.blur_px = steps.blur_px;
    auto better = shape.light_of(std::move(steps.points), background);
    if (!better || 2 * better->outline.size() < light.outline.size()) return false;
    light = std::move(*better);
  }
  const auto steps = fit_rim_steps(image, light, lit_lines, background, picture, true, shape);
  const auto shift = shift_of(steps.pieces, shape.has_lens());
  picture.gamma = other_gamma;
  const auto other =
      shift_of(fit_rim_steps(image, light, lit_lines, background, picture, true, shape).pieces,
               shape.has_lens());
  if (!shift || !other) return false;
  light.pixel += shape.turned(shift->px);
  sigma_px = std::sqrt(shift->covariance.trace() / 2 + (shift->px - other->px).squaredNorm() / 2);
  return shift->agreeing > most * double(steps.looked_at);
}

}  // namespace

bool unevenly_lit(const ImageView& image, const Blob& blob, const std::vector<EdgePoint>& outline,
                  const Background& background) {
  constexpr double much = 3, least_ends = 0.2;
  constexpr int least_width = 8;
  if (outline.empty()) return false;
  const auto wide = std::count_if(blob.runs.begin(), blob.runs.end(),
                                  [](const Run& run) { return run.width() >= least_width; });
  if (double(outline.size()) < least_ends * 2 * double(wide)) return true;
  std::vector<double> levels;
  levels.reserve(outline.size());
  for (const EdgePoint& point : outline) levels.push_back(point.level);
  const double inside = visit_levels(image, [&](auto level) {
    return bright_level<decltype(level)>(image, blob, background.level);
  });
  return inside > much * upper_median(std::move(levels));
}

std::optional<Rim> rim_of(const ImageView& image, const Blob& blob, const Background& background,
                          const LightShape& shape) {
  constexpr int least_size = 20, least_lines = 10;
  constexpr double margin = 0.2, least_step = 0.28, clear_step = 0.33, least_shown = 0.5;
  constexpr double one_point = 2;
  const PixelBox box = blob.box();
  if (std::min(box.width, box.height) < least_size) return std::nullopt;
  const int more = static_cast<int>(margin * std::max(box.width, box.height));
  const PixelBox wide =
      intersection({box.x - more, box.y - more, box.width + 2 * more, box.height + 2 * more},
                   {0, 0, image.width, image.height});
  // As coarse as the search for the ring; fine enough for the rim.
  const int size = std::max(wide.width, wide.height);
  const int fine = std::clamp(size / 30, 2, 6), coarse = std::max(fine, size / 50);
  const Face blurred(image, wide, background, coarse);
  const Face face = fine == coarse ? blurred : Face(image, wide, background, fine);
  if (face.lit_lines().size() < least_lines) return std::nullopt;
  const auto [best, other] = best_rings(blurred, box);
  const auto crossings = 2 * std::count_if(face.lit_lines().begin(), face.lit_lines().end(),
                                           [&, v = best.v, r = best.radius](int line) {
                                             return std::abs(line - v) < r;
                                           });
  if (!(best.sum > least_step * double(crossings))) return std::nullopt;

  Eigen::Vector2d center(best.u + wide.x, best.v + wide.y);
  Eigen::Vector2d low = center.array() - best.radius, high = center.array() + best.radius;
  std::optional<Light> light;
  for (const double reach : {0.16, 0.12, 0.08, 0.08}) {
    auto better = shape.light_of(steps_near(face, low, high, reach * best.radius), background);
    if (!better) return std::nullopt;
    light = std::move(better);
    low = shape.turned(light->low), high = shape.turned(light->high);
  }
  // Before the steps are fitted, of which there are others.
  const double shown = std::min(1.0, double(light->outline.size()) / double(crossings));
  double sigma_px = light->sigma_px * std::sqrt(points_of_a_stripe(light->outline));
  const bool fitted =
      fit_to_steps(image, face.lit_lines_of_image(), background, shape, *light, sigma_px);
  // The other ring may be the rim, unless most of this one has a step.
  const double odds = fitted ? 0 : 1 / (1 + std::exp((best.sum - other.sum) / one_point));
  const double away = std::pow(best.u - other.u, 2) + std::pow(best.v - other.v, 2);
  light->sigma_px = std::sqrt(sigma_px * sigma_px + odds * away / 2);
  light->uneven = true;
  light->roundness = shown;
  const bool clear =
      fitted || (best.sum > clear_step * double(crossings) && light->roundness > least_shown);
  return Rim{std::move(*light), clear};
}

}  // namespace vlp
