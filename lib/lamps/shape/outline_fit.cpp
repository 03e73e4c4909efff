// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "lamps/shape/plane_patch.h"
#include "lamps/shape/shear.h"
#include "rig/detection.h"

namespace vlp {
namespace {

/// Tone curve light^(1 / gamma) of consumer cameras.
constexpr float kGamma = 2.2F;
/// Prior mean and standard deviation of the weight of the tone curve, which is 0 for a linear
/// camera.
constexpr double kMeanTone = 0.85, kToneSd = 0.2;
/// Blur at which the fit becomes fine, and prior standard deviation of its logarithm.
constexpr double kBlur_px = 0.9, kLogBlurSd = 0.4;
/// Minimum unevenness of a rim. The noise of a sharp image causes less.
constexpr double kMinUnevenness = 0.02;
/// Standard deviation of the area of a pixel.
constexpr double kMinBlur_px = 0.29;
/// Depth, in blurs, from which on a pixel is well inside the outline.
constexpr double kClearBlurs = 2.5;

/// Unknowns of an outline, in pixels: center, size and ovality. A rectangle has the rotations of
/// both pairs of sides in place of the second ovality, and the keystone and the distortion.
enum Unknown {
  kX,
  kY,
  kSize,
  kOval0,
  kOval1,
  kDiscUnknowns,
  kTurn0 = kOval1,
  kTurn1,
  kKeystone0,
  kKeystone1,
  kDistortion,
  kRectangleUnknowns
};

/// Levels of a cell. That of a rectangle may also change along the scanline.
enum Level {
  kOut,
  kIn,
  kInSlope,
  kOutSlope,
  kDiscLevels,
  kInAlong = kDiscLevels,
  kRectangleLevels
};

/// Part of a scanline on one side of the center. The residual is the last column of the products of
/// the `N` unknowns, after elimination of the levels.
template <int N, int L>
struct Cell {
  std::size_t begin, end;  ///< samples
  Eigen::Matrix<double, L, 1> levels = Eigen::Matrix<double, L, 1>::Zero();
  double deepest_px = -std::numeric_limits<double>::infinity();
  Eigen::Matrix<float, N + 1, N + 1> products;
  /// Tukey's biweight of the cell, 0 to 1.
  double weight = 1;
  /// Number of pixels minus that of the levels that they determine.
  double degrees_of_freedom;
  /// Mean squared residual, weighted and in gray levels, and mean level above the dark level.
  double mean_weighted_square, mean_square, mean_level;

  std::size_t size() const { return end - begin; }
  double contrast() const { return std::abs(levels[kIn] - levels[kOut]); }
};

/// Returns the derivative of the plane with respect to (column, line) at a pixel, or at the pixel
/// of the box nearest to it.
Matrix2 compute_derivative(const PlanePatch& patch, const PixelBox& box,
                           const Eigen::Vector2d& pixel) {
  const double column = std::clamp(pixel.x(), double(box.x), box.end_column() - 1.0),
               line = std::clamp(pixel.y(), double(box.y), box.end_row() - 1.0);
  return PlanePatch::Row(patch, line).at_column(column).d_at_d_pixel;
}

/// Returns the value that the given fraction of the values does not exceed.
double compute_quantile(std::vector<double> values, double fraction) {
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Position of a pixel relative to an outline: its distance from the center as a multiple of that
/// of the outline, the derivative of this distance with respect to the normalized position, and the
/// size of a unit of it, in pixels.
struct Position {
  double distance;
  Eigen::Vector2d gradient;
  double scale_px;
};

/// Prior knowledge of an outline.
struct Priors {
  /// Disc: true if its ovality is 0, and its radius.
  bool is_round = true;
  std::optional<KnownRadius> radius = {};
  /// Rectangle: standard deviations of shear, keystone and distortion; see PlaneRectangle.
  double shear_sd = 0;
  Eigen::Vector2d keystone_sd = Eigen::Vector2d::Zero();
  double distortion_sd = 0;
  std::span<const Eigen::Vector2d> sizes_m = {};
};

struct Disc {
  using Outline = PlaneEllipse;
  using Fit = OutlineFit;
  static constexpr int kGeometry = kDiscUnknowns, kLevels = kDiscLevels;
  /// Returns the position of a pixel at `u`, of which the derivative is `u_from_pixel`.
  static std::optional<Position> locate(const Eigen::Vector2d& u, const Matrix2& u_from_pixel) {
    const double distance = u.norm();
    const Eigen::Vector2d gradient = u / distance;
    return Position{distance, gradient, 1 / (u_from_pixel.transpose() * gradient).norm()};
  }
};

struct Rectangle {
  using Outline = PlaneRectangle;
  using Fit = RectangleFit;
  static constexpr int kGeometry = kRectangleUnknowns, kLevels = kRectangleLevels;
  /// Returns the position relative to the nearest side; std::nullopt near a corner.
  static std::optional<Position> locate(const Eigen::Vector2d& u, const Matrix2& u_from_pixel) {
    constexpr double max_corner_px = 4, corner_fraction = 0.5;
    const Eigen::Vector2d scale_px = u_from_pixel.rowwise().norm().cwiseInverse();
    const Eigen::Vector2d depth_px = (1 - u.array().abs()) * scale_px.array();
    const int side = depth_px[0] < depth_px[1] ? 0 : 1;
    if (depth_px[1 - side] < std::min(max_corner_px, corner_fraction * scale_px[1 - side]))
      return std::nullopt;
    return Position{std::abs(u[side]), std::copysign(1.0, u[side]) * Eigen::Vector2d::Unit(side),
                    scale_px[side]};
  }
};

template <typename Shape>
class OutlineFitter {
  static constexpr bool is_rectangle = std::is_same_v<Shape, Rectangle>;
  static constexpr int kGeometry = Shape::kGeometry, kLogBlur = kGeometry, kTone = kGeometry + 1,
                       kUnknowns = kGeometry + 2, kLevels = Shape::kLevels;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Geometry = Eigen::Matrix<float, kGeometry, 1>;
  using Levels = Eigen::Matrix<double, kLevels, 1>;
  using LevelsMatrix = Eigen::Matrix<double, kLevels, kLevels>;
  using Shares = Eigen::Matrix<float, kLevels, 1>;
  using Cell = vlp::Cell<kUnknowns, kLevels>;
  using Outline = typename Shape::Outline;
  using Fit = typename Shape::Fit;

 public:
  OutlineFitter(const ImageView& lines, const PlanePatch& patch, const PixelBox& box,
                const Outline& start, double period_lines, const Background& background,
                const Eigen::Vector2d& center_px, const Priors& priors)
      : lines_(lines),
        patch_(patch),
        box_(box),
        start_center_(start.center),
        outline_(start),
        period_lines_(period_lines > 0 ? period_lines : 1),
        background_(background),
        center_px_(center_px),
        priors_(priors),
        d_plane_d_pixel_(compute_derivative(patch, box, center_px)),
        px_per_unit_(1 / std::sqrt(std::abs(d_plane_d_pixel_.determinant()))) {
    update_radius();
  }

  std::optional<Fit> run(double start_blur_px) {
    constexpr double tolerance_px = 0.01;
    constexpr int max_moves = 3;
    blur_px_ = std::max(kMinBlur_px, start_blur_px);
    start_radius_px_ = radius_px_;
    double step_px = iterate(tolerance_px);
    if constexpr (is_rectangle) {
      for (int move = 0; step_px < kFarStep_px && move < max_moves && move_misplaced_sides();
           ++move) {
        if (priors_.distortion_sd > 0) return std::nullopt;  // see place_hidden_sides()
        step_px = iterate(tolerance_px);
      }
    }
    if (is_coarse_ || step_px >= kFarStep_px) return std::nullopt;
    auto fit = make_result();
    if (!fit) return fit;
    if (step_px >= tolerance_px) fit->add_center_error(step_px);
    const double unevenness = compute_unevenness();
    if constexpr (!is_rectangle) {
      fit->unevenness = unevenness;
      fit->level = compute_median_level();
    }
    if (unevenness < kMinUnevenness) return fit;
    const auto shift_px = measure_shift_px();
    if (!shift_px) return std::nullopt;
    fit->add_center_error(*shift_px);
    return fit;
  }

 private:
  static constexpr double kFarStep_px = 1e9;

  /// Returns the length of the last step, in pixels.
  double iterate(double tolerance_px) {
    constexpr int max_rounds = 60;
    constexpr double shrink = 0.6, max_fine_blur_px = 1.2;
    double step_px = kFarStep_px;
    for (int round = 0; round < max_rounds; ++round) {
      is_coarse_ = is_coarse_ && blur_px_ > max_fine_blur_px;
      if (!update_samples()) return kFarStep_px;
      if (is_first_round_) initialize_levels();
      is_first_round_ = false;
      if (!accumulate()) return kFarStep_px;
      step_px = take_step();
      if (!std::isfinite(step_px) || is_far_from_start()) return kFarStep_px;
      if (!is_coarse_ && step_px < tolerance_px) break;
      if (is_coarse_ && step_px < blur_px_) blur_px_ *= shrink;
    }
    return step_px;
  }

  /// Returns true if center or radius differ from the first ones by more than a quarter of the
  /// radius.
  bool is_far_from_start() const {
    constexpr double max_change = is_rectangle ? 1 : 0.25;
    return (outline_.center - start_center_).norm() * px_per_unit_ >
               max_change * start_radius_px_ ||
           std::abs(radius_px_ - start_radius_px_) > max_change * start_radius_px_;
  }

  /// Returns the RMS slope of the levels inside along the scanlines, as a fraction of the level.
  double compute_unevenness() const {
    double sum = 0, count = 0;
    for (const Cell& cell : cells_) {
      if (cell.size() == 0 || !(cell.contrast() > min_contrast_)) continue;
      sum += std::pow(cell.levels[kInSlope] / std::max(1.0, cell.levels[kIn]), 2);
      ++count;
    }
    return std::sqrt(sum / std::max(1.0, count));
  }

  /// Returns the median of the levels inside of the cells with contrast.
  double compute_median_level() const {
    std::vector<double> levels;
    for (const Cell& cell : cells_) {
      if (cell.size() > 0 && cell.contrast() > min_contrast_)
        levels.push_back(cell.levels[kIn] - background_.level);
    }
    return levels.empty() ? 0 : upper_median(std::move(levels));
  }

  /// Returns the distance of the center from that of a fit in a narrower band. Levels that do not
  /// vary linearly with the depth shift the outline by a distance that depends on the band. Returns
  /// std::nullopt if the narrower band does not determine the outline.
  std::optional<double> measure_shift_px() {
    constexpr double narrow_band = 0.65;
    constexpr int rounds = 2;
    const Outline outline = outline_;
    band_ = narrow_band;
    levels_.clear();
    for (int round = 0; round < rounds; ++round) {
      if (!update_samples() || !accumulate() || !std::isfinite(take_step())) {
        return std::nullopt;
      }
    }
    return (outline_.center - outline.center).norm() * px_per_unit_;
  }

  void update_radius() { radius_px_ = px_per_unit_ * outline_.radius(); }

  /// Selects the pixels of the band around the outline if it has moved out of it, and computes
  /// their depths. Returns false if there are too few.
  bool update_samples() {
    constexpr double min_reach_px = 5, reach_blurs = 3, coarse_reach_blurs = 3.5;
    constexpr double max_reach_change_px = 0.5, max_move_px = 0.5;
    constexpr std::size_t min_samples = 60;
    const double reach_px = is_coarse_ ? coarse_reach_blurs * blur_px_
                                       : band_ * std::max(min_reach_px, reach_blurs * blur_px_);
    if (levels_.empty() || moved_px_ + std::abs(size_change_px_) > max_move_px ||
        std::abs(reach_px - reach_px_) > max_reach_change_px) {
      reach_px_ = reach_px;
      moved_px_ = size_change_px_ = 0;
      select_samples();
    }
    compute_depths();
    return levels_.size() >= min_samples;
  }

  static double square(double value) { return value * value; }

  void compute_depths() {
    const auto n = Eigen::Index(levels_.size());
    const Eigen::Map<const Eigen::ArrayXf> x(plane_x_.data(), n), y(plane_y_.data(), n),
        scale_px(scales_px_.data(), n);
    const Eigen::Matrix2f unit_from_plane = outline_.unit_from_plane.template cast<float>();
    const Eigen::Vector2f offset =
        (outline_.unit_from_plane * (start_center_ - outline_.center)).template cast<float>();
    z_ = unit_from_plane(0, 0) * x + unit_from_plane(0, 1) * y + offset.x();
    t_ = unit_from_plane(1, 0) * x + unit_from_plane(1, 1) * y + offset.y();
    const auto growth = static_cast<float>(radius_px_ / selection_radius_px_);
    if constexpr (is_rectangle) {
      const Eigen::Map<const Eigen::ArrayXf> side_x(side_x_.data(), n), side_y(side_y_.data(), n),
          bend_x(bend_x_.data(), n), bend_y(bend_y_.data(), n);
      const Eigen::Matrix2f bend = unit_from_plane * float(outline_.distortion);
      z_ += bend(0, 0) * bend_x + bend(0, 1) * bend_y;
      t_ += bend(1, 0) * bend_x + bend(1, 1) * bend_y;
      const Eigen::Vector2f keystone = outline_.keystone.template cast<float>();
      depths_px_ = (1 - (side_x * z_ + side_y * t_) / (1 + keystone.x() * z_ + keystone.y() * t_)) *
                   scale_px * growth;
    } else {
      depths_px_ = (1 - (z_.square() + t_.square()).sqrt()) * scale_px * growth;
    }
  }

  void select_samples() {
    constexpr double bright_quantile = 0.95;
    constexpr std::size_t sample_step = 4;
    for (std::vector<float>* values : {&levels_, &plane_x_, &plane_y_, &scales_px_, &side_x_,
                                       &side_y_, &bend_x_, &bend_y_, &columns_})
      values->clear();
    d_depths_.clear();
    selection_radius_px_ = radius_px_;
    cells_.resize(2 * std::size_t(box_.height));
    const Matrix2 unit_from_pixel = outline_.unit_from_plane * d_plane_d_pixel_;
    const Eigen::Vector2d offset = outline_.unit_from_plane * (start_center_ - outline_.center);
    // Bounds of the distance from the center by the map linearized at the center.
    const auto compute_nonlinearity = [&](double column, double line) {
      const Eigen::Vector2d at = PlanePatch::Row(patch_, line).at_column(column).at;
      const Eigen::Vector2d linear =
          start_center_ + d_plane_d_pixel_ * (Eigen::Vector2d(column, line) - center_px_);
      return (outline_.unit_from_plane * (at - linear)).norm();
    };
    double nonlinearity = 0;
    for (const int line : {box_.y, box_.end_row() - 1}) {
      for (const int column : {box_.x, box_.end_column() - 1})
        nonlinearity = std::max(nonlinearity, compute_nonlinearity(column, line));
    }
    if constexpr (is_rectangle) nonlinearity += outline_.compute_nonlinearity();
    const double max_difference =
        nonlinearity + (1 + nonlinearity) * reach_px_ * unit_from_pixel.norm();
    const double inner = std::pow(std::max(0.01, 1 - max_difference), 2),
                 outer = std::pow(1 + max_difference, 2);
    const int middle =
        std::clamp(static_cast<int>(std::floor(center_px_.x())) + 1, box_.x, box_.end_column());
    for (int line = box_.y; line < box_.end_row(); ++line) {
      const PlanePatch::Row row(patch_, line);
      const Eigen::Vector2d line_offset = offset + unit_from_pixel.col(1) * (line - center_px_.y());
      for (const int side : {0, 1}) {
        Cell& cell = cells_[2 * std::size_t(line - box_.y) + std::size_t(side)];
        cell.begin = levels_.size();
        const int end = side == 0 ? middle : box_.end_column();
        for (int column = side == 0 ? box_.x : middle; column < end; ++column) {
          const Eigen::Vector2d u =
              line_offset + unit_from_pixel.col(0) * (column - center_px_.x());
          const double square = is_rectangle ? u.cwiseAbs2().maxCoeff() : u.squaredNorm();
          if (square > inner && square < outer) add_sample(row, column, line);
        }
        cell.end = levels_.size();
        if (cell.size() == 0) cell.deepest_px = -std::numeric_limits<double>::infinity();
      }
    }
    if (levels_.empty()) return;
    std::vector<double> sampled_levels;
    for (std::size_t i = 0; i < levels_.size(); i += sample_step)
      sampled_levels.push_back(levels_[i]);
    bright_level_ = std::max(1.0, compute_quantile(std::move(sampled_levels), bright_quantile));
  }

  /// Estimates the levels of the cells by the means of the pixels clearly inside and outside.
  void initialize_levels() {
    constexpr float clear_blurs = 1.5;
    const float clear_px = clear_blurs * static_cast<float>(blur_px_);
    for (Cell& cell : cells_) {
      std::array<float, 2> sums{}, counts{};
      for (std::size_t i = cell.begin; i < cell.end; ++i) {
        if (std::abs(depths_px_[Eigen::Index(i)]) < clear_px) continue;
        const std::size_t side = depths_px_[Eigen::Index(i)] > 0 ? kIn : kOut;
        sums[side] += levels_[i];
        ++counts[side];
        cell.deepest_px = std::max(cell.deepest_px, double(depths_px_[Eigen::Index(i)]));
      }
      for (const std::size_t side : {kOut, kIn}) {
        const std::size_t known = counts[side] > 0 ? side : 1 - side;
        cell.levels[Eigen::Index(side)] = sums[known] / std::max(1.F, counts[known]);
      }
    }
  }

  /// Adds a pixel if it is in the band, with the derivatives of its depth.
  void add_sample(const PlanePatch::Row& row, int column, int line) {
    const PlanePatch::Point plane = row.at_column(column);
    Eigen::Vector2d u = outline_.unit_from_plane * (plane.at - outline_.center);
    Matrix2 u_from_plane = outline_.unit_from_plane;
    if constexpr (is_rectangle) {
      u = outline_.unit_from_plane_point(plane.at);
      const double scale = 1 - outline_.keystone.dot(u);
      u_from_plane = scale * (u_from_plane - u * (outline_.keystone.transpose() * u_from_plane));
    }
    const auto position = Shape::locate(u, u_from_plane * plane.d_at_d_pixel);
    if (!position) return;
    const auto& [distance, gradient, px] = *position;
    if (!(std::abs((1 - distance) * px) < reach_px_)) return;
    const Eigen::Vector2d from_start = plane.at - start_center_;
    levels_.push_back(static_cast<float>(lines_.gray_level_at_pixel(column, line)));
    plane_x_.push_back(static_cast<float>(from_start.x()));
    plane_y_.push_back(static_cast<float>(from_start.y()));
    scales_px_.push_back(static_cast<float>(px));
    const Eigen::Vector2d d_plane = u_from_plane.transpose() * gradient * px;
    const Eigen::Vector2d along = gradient.cwiseProduct(u) * px / radius_px_,
                          across = gradient.cwiseProduct(Eigen::Vector2d(u.y(), u.x())) * px /
                                   radius_px_;
    Eigen::Matrix<double, kGeometry, 1> d_depth;
    d_depth.template head<2>() = d_plane / px_per_unit_;
    d_depth[kSize] = along.sum();
    d_depth[kOval0] = along[0] - along[1];
    if constexpr (is_rectangle) {
      const double aspect = outline_.aspect();
      const Eigen::Vector2d bend = outline_.compute_bend(plane.at);
      d_depth[kTurn0] = across[1] * aspect;
      d_depth[kTurn1] = across[0] / aspect;
      d_depth[kKeystone0] = along.sum() * u.x();
      d_depth[kKeystone1] = along.sum() * u.y();
      d_depth[kDistortion] = -d_plane.dot(bend) * priors_.distortion_sd;
      side_x_.push_back(static_cast<float>(gradient.x()));
      side_y_.push_back(static_cast<float>(gradient.y()));
      bend_x_.push_back(static_cast<float>(bend.x()));
      bend_y_.push_back(static_cast<float>(bend.y()));
      columns_.push_back(static_cast<float>(column - center_px_.x()));
    } else {
      d_depth[kOval1] = across.sum();
    }
    d_depths_.push_back(d_depth.template cast<float>());
  }

  /// Computes the coverages in levels, and their derivatives, of all samples.
  void compute_coverages() {
    constexpr float min_ratio = 1e-3F, max_ratio = 0.98F;
    const auto n = Eigen::Index(levels_.size());
    for (Eigen::ArrayXf* each : {&ratio_, &power_, &sign_}) each->resize(n);
    for (const Cell& cell : cells_) {
      const auto begin = Eigen::Index(cell.begin), size = Eigen::Index(cell.size());
      if (size == 0) continue;
      const auto out = static_cast<float>(cell.levels[kOut]),
                 in = static_cast<float>(cell.levels[kIn]);
      const float brighter = std::max(out, in);
      const float ratio =
          brighter > 0 ? std::clamp(std::min(out, in) / brighter, min_ratio, max_ratio) : max_ratio;
      ratio_.segment(begin, size) = ratio;
      power_.segment(begin, size) = std::pow(ratio, kGamma);
      sign_.segment(begin, size) = out > in ? -1.F : 1.F;
    }
    z_ = depths_px_ * float(1 / blur_px_);
    density_ = (-0.5F * z_.square()).exp() * float(1 / std::sqrt(2 * std::numbers::pi));
    // Normal distribution, Abramowitz and Stegun 26.2.17; error 7.5e-8.
    t_ = (1 + 0.2316419F * z_.abs()).inverse();
    t_ = density_ * t_ *
         (0.319381530F +
          t_ * (-0.356563782F + t_ * (1.781477937F + t_ * (-1.821255978F + t_ * 1.330274429F))));
    // The tone curve acts on the coverage by the brighter side.
    coverage_ = (sign_ * z_ > 0).select(1 - t_, t_);
    t_ = power_ + (1 - power_) * coverage_;
    coded_ = (t_.log() * (1 / kGamma)).exp();
    const auto tone = static_cast<float>(tone_);
    d_z_ = density_ * (1 - tone + tone * (1 - power_) * coded_ / (kGamma * t_ * (1 - ratio_)));
    d_tone_ = (coded_ - ratio_) / (1 - ratio_) - coverage_;
    coverage_ += tone * d_tone_;
    d_tone_ *= sign_;
    coverage_ = (sign_ > 0).select(coverage_, 1 - coverage_);
  }

  /// Returns the level inside at a sample relative to that at the column of the center.
  float get_gain(std::size_t sample) const {
    return is_rectangle ? 1 + static_cast<float>(level_slope_) * columns_[sample] : 1.F;
  }

  /// Returns the shares of the levels of the cell in that of a sample.
  Shares compute_shares(std::size_t sample) const {
    const float inside = coverage_[Eigen::Index(sample)],
                depth_px = depths_px_[Eigen::Index(sample)];
    const float inside_level = inside * get_gain(sample);
    Shares shares;
    shares.template head<4>() << 1 - inside, inside_level, depth_px * inside_level,
        depth_px * (1 - inside);
    if constexpr (is_rectangle) shares[kInAlong] = columns_[sample] * inside_level;
    return shares;
  }

  float predict_variance(float level) const {
    constexpr float min_fraction = 0.1F;
    // Errors of the model are not proportional to the level: dark pixels must not dominate.
    return predict_variance(static_cast<float>(variance_per_level_),
                            std::max(level - static_cast<float>(background_.level),
                                     min_fraction * static_cast<float>(bright_level_)));
  }
  float predict_variance(float variance_per_level, float level) const {
    constexpr float quantization = 0.1F, model_error = 0.003F;
    return static_cast<float>(background_.noise * background_.noise) + quantization +
           (variance_per_level + model_error * model_error * level) * level;
  }

  /// Solves for the levels of all cells, and sums the products of their derivatives. Returns false
  /// if the levels are not finite.
  bool accumulate() {
    compute_coverages();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i].size() > 0 && !solve_cell(i)) return false;
    }
    add_cells();
    return true;
  }

  bool solve_cell(std::size_t index) {
    Cell& cell = cells_[index];
    Eigen::Matrix<float, kLevels, kLevels> shares_square =
        Eigen::Matrix<float, kLevels, kLevels>::Zero();
    Shares right = Shares::Zero();
    const Shares old_levels = cell.levels.template cast<float>();
    float deepest = -std::numeric_limits<float>::infinity();
    weights_.resize(cell.size());
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      const Shares shares = compute_shares(i);
      const float weight = 1 / predict_variance(shares.dot(old_levels));
      weights_[i - cell.begin] = weight;
      shares_square.noalias() += weight * shares * shares.transpose();
      right += weight * levels_[i] * shares;
      deepest = std::max(deepest, depths_px_[Eigen::Index(i)]);
    }
    cell.deepest_px = deepest;
    const auto [prediction, information] = predict_levels(index);
    const LevelsMatrix inverse =
        (shares_square.template cast<double>() + LevelsMatrix(information.asDiagonal())).inverse();
    cell.levels = inverse * (right.template cast<double>() + information.cwiseProduct(prediction));
    if (!cell.levels.allFinite()) return false;
    cell.degrees_of_freedom =
        std::max(1.0, double(cell.size()) - kLevels + inverse.diagonal().dot(information));
    compute_products(inverse, cell);
    return true;
  }

  /// Computes the products of a cell, of which the inverse normal matrix of the levels is given.
  void compute_products(const LevelsMatrix& inverse, Cell& cell) {
    using Row = Eigen::Matrix<float, kUnknowns + 1, 1>;
    using Products = Eigen::Matrix<float, kUnknowns + 1, kUnknowns + 1>;
    Products products = Products::Zero();
    Eigen::Matrix<float, kLevels, kUnknowns + 1> with_shares;
    with_shares.setZero();
    const Shares levels = cell.levels.template cast<float>();
    const auto per_blur = static_cast<float>(1 / blur_px_);
    float squares = 0, sum = 0;
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      const auto at = Eigen::Index(i);
      const Shares shares = compute_shares(i);
      float in = levels[kIn] + levels[kInSlope] * depths_px_[at];
      if constexpr (is_rectangle) in += levels[kInAlong] * columns_[i];
      const float d_coverage = get_gain(i) * in - levels[kOut] - levels[kOutSlope] * depths_px_[at];
      const float d_z = d_coverage * d_z_[at];
      const float d_depth =
          d_z * per_blur + levels[kInSlope] * shares[kIn] + levels[kOutSlope] * shares[kOut];
      Row row;
      row.template head<kGeometry>() = d_depth * d_depths_[i];
      row[kLogBlur] = -d_z * z_[at];
      row[kTone] = d_coverage * d_tone_[at];
      const float residual = levels_[i] - shares.dot(levels);
      row[kUnknowns] = residual;
      const Row weighted = weights_[i - cell.begin] * row;
      products.noalias() += weighted * row.transpose();
      with_shares.noalias() += shares * weighted.transpose();
      squares += residual * residual;
      sum += levels_[i];
    }
    cell.mean_weighted_square = products(kUnknowns, kUnknowns) / cell.degrees_of_freedom;
    cell.mean_square = squares / cell.degrees_of_freedom;
    cell.mean_level = std::max(1.0, sum / double(cell.size()) - background_.level);
    const Eigen::Matrix<float, kLevels, kUnknowns + 1> gain =
        inverse.template cast<float>().lazyProduct(with_shares);
    cell.products = products - with_shares.transpose().lazyProduct(gain);
  }

  /// Returns the levels that a cell has if its pixels do not show them, and their information.
  std::pair<Levels, Levels> predict_levels(std::size_t index) const {
    constexpr double unknown_level_sd = 30, slope_sd = 0.03, along_sd = 0.001, min_level = 0.02;
    const Cell& cell = cells_[index];
    const double lowest = min_level * bright_level_;
    Levels prediction = Levels::Zero(), sd = Levels::Constant(unknown_level_sd * bright_level_);
    sd[kInSlope] = slope_sd * std::max(std::abs(cell.levels[kIn]), lowest);
    if constexpr (is_rectangle)
      sd[kInAlong] = along_sd * std::max(std::abs(cell.levels[kIn]), lowest);
    sd[kOutSlope] = slope_sd * std::max(std::abs(cell.levels[kOut]), lowest);
    if (!is_clear(cell)) {
      const auto [level, level_sd] = predict_level_inside(index);
      if (level_sd > 0) prediction[kIn] = level, sd[kIn] = std::max(level_sd, lowest);
    }
    return {prediction, sd.cwiseAbs2().cwiseInverse()};
  }

  bool is_clear(const Cell& cell) const { return cell.deepest_px > kClearBlurs * blur_px_; }

  /// Returns the level inside from the cells of the same side whole periods away, and its standard
  /// deviation; 0 if there are none.
  std::pair<double, double> predict_level_inside(std::size_t index) const {
    constexpr double half_ramp = 0.5, sd_of_several = 0.08, sd_of_one = 0.3;
    const std::size_t row = index / 2;
    double sum = 0, squares = 0, ramps = 0, count = 0;
    for (const int periods : {-2, -1, 1, 2}) {
      const double line = double(row) + periods * period_lines_, low = std::floor(line);
      if (low < 0 || low + 1 >= double(box_.height)) continue;
      const Cell& a = cells_[2 * std::size_t(low) + index % 2];
      const Cell& b = cells_[2 * std::size_t(low) + 2 + index % 2];
      if (!is_clear(a) || !is_clear(b)) continue;
      const double ramp = b.levels[kIn] - a.levels[kIn];
      const double level = a.levels[kIn] + (line - low) * ramp;
      sum += level;
      squares += level * level;
      ramps += std::abs(ramp);
      ++count;
    }
    if (count == 0) return {0, 0};
    const double mean = sum / count, ramp = half_ramp * ramps / count;
    const double scatter = std::max(0.0, squares / count - mean * mean);
    const double unknown = (count > 1 ? sd_of_several : sd_of_one) * mean;
    return {mean, std::sqrt(scatter + ramp * ramp + unknown * unknown)};
  }

  /// Updates the relative slope of the level along the scanlines by the ratios of the levels on
  /// both sides of the center.
  void update_level_slope() {
    constexpr double max_slope = 0.01;
    constexpr std::size_t min_pairs = 8;
    std::vector<double> slopes;
    for (std::size_t i = 0; i < cells_.size(); i += 2) {
      const Cell &left = cells_[i], &right = cells_[i + 1];
      if (left.size() == 0 || right.size() == 0 || !is_clear(left) || !is_clear(right) ||
          std::min(left.contrast(), right.contrast()) < min_contrast_)
        continue;
      const double columns = compute_mean_column(right) - compute_mean_column(left);
      slopes.push_back(2 * (right.levels[kIn] - left.levels[kIn]) /
                       (columns * (right.levels[kIn] + left.levels[kIn])));
    }
    if (slopes.size() < min_pairs) return;
    level_slope_ =
        std::clamp(level_slope_ + upper_median(std::move(slopes)), -max_slope, max_slope);
  }

  double compute_mean_column(const Cell& cell) const {
    double sum = 0, count = 0;
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      if (depths_px_[Eigen::Index(i)] > 0) sum += double(columns_[i]), ++count;
    }
    return sum / std::max(1.0, count);
  }

  /// Adds the products of all cells. Applies the biweight to whole cells, as those of an occluder:
  /// far from the solution the pixels of the outline itself have the largest residuals. Estimates
  /// the variance per level from the residuals of the cells with contrast: in dark cells
  /// quantization would look like precision.
  void add_cells() {
    constexpr double min_contrast = 0.2, high_quantile = 0.95, reach_sds = 3, min_weight = 0.3,
                     min_fraction = 0.5;
    std::vector<double> contrasts, slopes, squares;
    for (const Cell& cell : cells_) {
      if (cell.size() > 0) contrasts.push_back(cell.contrast());
    }
    min_contrast_ = min_contrast * compute_quantile(std::move(contrasts), high_quantile);
    for (const Cell& cell : cells_) {
      if (cell.size() == 0 || !(cell.contrast() > min_contrast_)) continue;
      const float without_slope = predict_variance(0, static_cast<float>(cell.mean_level));
      slopes.push_back((cell.mean_square - without_slope) / cell.mean_level);
      squares.push_back(cell.mean_weighted_square);
    }
    double max_square = std::numeric_limits<double>::infinity();
    if (!slopes.empty()) {
      variance_per_level_ = std::max(0.0, upper_median(std::move(slopes)));
      max_square = reach_sds * reach_sds * upper_median(std::move(squares)) + 1e-30;
    }
    if constexpr (is_rectangle) update_level_slope();
    products_.setZero();
    squares_ = degrees_of_freedom_ = 0;
    double num_agreeing = 0, num_with_contrast = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      Cell& cell = cells_[i];
      if (cell.size() == 0) continue;
      if (is_rectangle && cell.contrast() < min_fraction * min_contrast_) {
        cell.weight = 0;  // the contrast may be that of noise
        continue;
      }
      const double u = std::max(0.0, 1 - cell.mean_weighted_square / max_square), weight = u * u;
      cell.weight = weight;
      products_ += weight * cell.products.template cast<double>();
      squares_ += weight * cell.mean_weighted_square * cell.degrees_of_freedom;
      degrees_of_freedom_ += weight * cell.degrees_of_freedom;
      if (cell.contrast() > min_contrast_)
        num_agreeing += weight > min_weight ? 1 : 0, ++num_with_contrast;
    }
    inlier_fraction_ = num_agreeing / std::max(1.0, num_with_contrast);
  }

  bool is_free(int unknown) const {
    if (is_rectangle && unknown == kTone) return false;
    if (unknown >= kGeometry) return !is_coarse_;
    if constexpr (is_rectangle) return unknown != kDistortion || priors_.distortion_sd > 0;
    return unknown <= kSize || !priors_.is_round;
  }

  void add_size_prior(Matrix& normal, Vector& gradient) const {
    if (!priors_.radius) return;
    const double information = 1 / std::pow(priors_.radius->log_sd * radius_px_, 2);
    normal(kSize, kSize) += information;
    gradient[kSize] +=
        information * radius_px_ * std::log(priors_.radius->radius * px_per_unit_ / radius_px_);
  }

  /// Adds the priors, and removes the unknowns that are not free.
  void add_priors(Matrix& normal, Vector& gradient) const {
    constexpr double oval_sd = 0.25;
    add_size_prior(normal, gradient);
    const auto add = [&](int unknown, double sd, double difference) {
      normal(unknown, unknown) += 1 / (sd * sd);
      gradient[unknown] += difference / (sd * sd);
    };
    for (const int oval : {kOval0, kOval1}) add(oval, oval_sd * radius_px_, 0);
    if constexpr (is_rectangle) {
      const double shear_sd_px = priors_.shear_sd * radius_px_,
                   information = 1 / (shear_sd_px * shear_sd_px);
      normal.template block<2, 2>(kTurn0, kTurn0).array() += information;
      gradient.template segment<2>(kTurn0).array() -= information * outline_.shear() * radius_px_;
      for (const int i : {0, 1}) {
        add(kKeystone0 + i, priors_.keystone_sd[i] * radius_px_,
            -outline_.keystone[i] * radius_px_);
      }
      if (priors_.distortion_sd > 0)
        add(kDistortion, 1, -outline_.distortion / priors_.distortion_sd);
    }
    add(kLogBlur, kLogBlurSd, std::log(kBlur_px / blur_px_));
    add(kTone, kToneSd, kMeanTone - tone_);
    for (int i = 0; i < kUnknowns; ++i) {
      if (is_free(i)) continue;
      normal.row(i).setZero();
      normal.col(i).setZero();
      normal(i, i) = 1;
      gradient[i] = 0;
    }
  }

  /// Takes a Gauss-Newton step of limited length. Returns the length of the full step in pixels.
  /// The size counts little: size, blur and tone converge slowly if they have the same effect.
  double take_step() {
    constexpr double max_step_px = 0.7, max_log_step = 0.2, max_tone = 1.3, size_weight = 0.2;
    Matrix normal = products_.template topLeftCorner<kUnknowns, kUnknowns>();
    Vector gradient = products_.col(kUnknowns).template head<kUnknowns>();
    add_priors(normal, gradient);
    Vector step = normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::numeric_limits<double>::infinity();
    const double size_px = std::abs(step[kSize]);
    const double step_px =
        std::hypot(step.template head<2>().norm(), step.template segment<2>(kOval0).norm());
    const double limit_px = is_coarse_ ? std::max(1.0, blur_px_) : max_step_px;
    step.template head<kGeometry>() /= std::max(1.0, std::hypot(step_px, size_px) / limit_px);
    step[kLogBlur] = std::clamp(step[kLogBlur], -max_log_step, max_log_step);
    moved_px_ += std::min(step_px, limit_px);
    size_change_px_ += step[kSize];
    move_outline(step);
    update_radius();
    blur_px_ = std::max(kMinBlur_px, blur_px_ * std::exp(step[kLogBlur]));
    tone_ = std::clamp(tone_ + step[kTone], 0.0, max_tone);
    products_.col(kUnknowns).template head<kUnknowns>() -=
        products_.template topLeftCorner<kUnknowns, kUnknowns>() * step;
    return std::max(step_px, size_weight * size_px);
  }

  void move_outline(const Vector& step) {
    outline_.center += step.template head<2>() / px_per_unit_;
    const Eigen::Vector2d oval = step.template segment<2>(kOval0) / radius_px_;
    Matrix2 unit_from_shape;
    if constexpr (is_rectangle) {
      const double turn1 = step[kTurn1] / radius_px_, aspect = outline_.aspect();
      unit_from_shape << 1 - oval[0], -turn1 / aspect, -oval[1] * aspect, 1 + oval[0];
      outline_.keystone += step.template segment<2>(kKeystone0) / radius_px_;
      outline_.distortion += step[kDistortion] * priors_.distortion_sd;
    } else {
      unit_from_shape = Oval{oval, {}}.unit_from_oval();
    }
    outline_.unit_from_plane = std::exp(-step[kSize] / radius_px_) /
                               std::sqrt(std::abs(unit_from_shape.determinant())) *
                               unit_from_shape * outline_.unit_from_plane;
  }

  /// Estimates the variance of the center, relative to that of the normal equations, by the power
  /// of radial errors that vary along the outline as cos(m a), with the direction a. An error with
  /// m = 1 moves the center and leaves no residuals; its power is taken to be the mean of those
  /// with m = 3 to 8.
  double estimate_inflation() const {
    constexpr int num_harmonics = 6;
    // Ratio of variances of independent errors and of the residuals after the biweight.
    constexpr double consistency = 1.5;
    std::array<std::complex<double>, num_harmonics> scores{};
    double information = 0;
    for (const Cell& cell : cells_) {
      if (cell.size() == 0) continue;
      const std::size_t middle = (cell.begin + cell.end) / 2;
      const Eigen::Vector2d from_start(plane_x_[middle], plane_y_[middle]),
          u = outline_.unit_from_plane * (start_center_ + from_start - outline_.center);
      std::complex<double> turn(u.x(), u.y());
      turn /= std::abs(turn);
      std::complex<double> power = turn * turn;
      for (std::complex<double>& score : scores) {
        power *= turn;
        score += cell.weight * cell.products(kSize, kUnknowns) * power;
      }
      information += cell.weight * cell.products(kSize, kSize);
    }
    double sum = 0;
    for (const std::complex<double>& score : scores) sum += std::norm(score);
    return consistency * sum / (num_harmonics * std::max(1e-30, information));
  }

  /// Side of a rectangle: the derivative of its outward displacement with respect to the unknowns,
  /// and the change of the unknowns that moves only this side by a pixel.
  struct SideMotion {
    Vector slope = Vector::Zero(), direction = Vector::Zero();
  };
  SideMotion compute_side_motion(int axis, int sign) const {
    const double scale = outline_.unit_from_plane.row(axis).norm();
    SideMotion side;
    side.slope.template head<2>() = sign * outline_.unit_from_plane.row(axis) / scale;
    side.slope[kSize] = px_per_unit_ / (scale * radius_px_);
    side.slope[kOval0] = axis == 0 ? side.slope[kSize] : -side.slope[kSize];
    side.direction.template head<2>() = side.slope.template head<2>() / 2;
    side.direction[kSize] = 1 / (4 * side.slope[kSize]);
    side.direction[kOval0] = 1 / (4 * side.slope[kOval0]);
    return side;
  }

  /// Moves sides that are far from their probable positions. Returns true if one was moved.
  bool move_misplaced_sides() {
    constexpr double min_offset_px = 1.5, min_sds = 3;
    bool is_moved = false;
    for (const int axis : {0, 1}) {
      for (const int sign : {-1, 1}) {
        const auto offset = estimate_side_offset(axis, sign);
        if (!offset || std::abs(offset->mean_px) < std::max(min_offset_px, min_sds * offset->sd_px))
          continue;
        move_outline(compute_side_motion(axis, sign).direction * offset->mean_px);
        update_radius();
        is_moved = true;
      }
    }
    levels_.clear();
    return is_moved;
  }

  /// Places the sides that dark stripes hide at their mean positions. Returns false if one is not
  /// known.
  bool place_hidden_sides(Matrix& covariance) {
    constexpr double min_sd_px = 0.25, unknown_sd_px = 100;
    bool is_hidden = false;
    for (const int axis : {0, 1}) {
      for (const int sign : {-1, 1}) {
        const auto offset = estimate_side_offset(axis, sign);
        const auto [slope, direction] = compute_side_motion(axis, sign);
        const double variance_px2 = slope.dot(covariance * slope);
        // Distortion and a hidden side are not known at once.
        if (priors_.distortion_sd > 0 && (!offset || offset->sd_px > min_sd_px)) return false;
        if (!offset && variance_px2 < square(min_sd_px)) continue;
        if (!offset) return false;
        if (offset->sd_px < min_sd_px) continue;
        covariance += square(unknown_sd_px) * direction * direction.transpose();
        const Vector gain =
            covariance * slope / (slope.dot(covariance * slope) + square(offset->sd_px));
        move_outline(gain * offset->mean_px);
        covariance -= gain * slope.transpose() * covariance;
        update_radius();
        is_hidden = true;
      }
    }
    if (is_hidden) apply_known_aspect(covariance);
    return true;
  }

  /// Corrects the outline by the aspect ratio of the only size that agrees with it.
  void apply_known_aspect(Matrix& covariance) {
    constexpr double size_sd_m = 0.001;  // sizes are given to the millimeter
    constexpr double max_sds = 3;
    // Errors of the model of the edge change the lengths of all sides.
    constexpr double edge_sd_blurs = 0.1;
    const double width_variance = square(edge_sd_blurs * blur_px_ / px_per_unit_) / 2 *
                                  outline_.unit_from_plane.rowwise().squaredNorm().sum();
    double correction = 0, variance = 0;
    int num_agreeing = 0;
    for (const Eigen::Vector2d& size_m : priors_.sizes_m) {
      const double relative_variance = square(priors_.shear_sd) +
                                       square(size_sd_m) * size_m.cwiseAbs2().cwiseInverse().sum() +
                                       width_variance;
      for (const double aspect : {size_m[0] / size_m[1], size_m[1] / size_m[0]}) {
        const double difference_px = radius_px_ / 2 * std::log(aspect / outline_.aspect());
        const double sum = covariance(kOval0, kOval0) + relative_variance * square(radius_px_) / 4;
        if (square(difference_px) > square(max_sds) * sum) continue;
        num_agreeing +=
            num_agreeing == 0 || std::abs(difference_px - correction) > 0.1 * std::sqrt(sum) ? 1
                                                                                             : 0;
        correction = difference_px;
        variance = sum;
      }
    }
    if (num_agreeing != 1) return;
    const Vector gain = covariance.col(kOval0) / variance;
    move_outline(gain * correction);
    covariance -= gain * covariance.row(kOval0);
    update_radius();
  }

  /// Returns the median level outside of the cells with contrast, above the dark level.
  double compute_halo() const {
    std::vector<double> levels;
    for (const Cell& cell : cells_) {
      if (cell.size() > 0 && cell.contrast() > min_contrast_)
        levels.push_back(cell.levels[kOut] - background_.level);
    }
    return levels.empty() ? 0 : std::max(0.0, upper_median(std::move(levels)));
  }

  /// Outward displacement of a side.
  struct SideOffset {
    double mean_px, sd_px;
  };

  /// Returns the box of the pixels up to a distance from the middle of a side; std::nullopt if they
  /// are not finite.
  std::optional<PixelBox> find_box_near_side(int axis, int sign, double half_px, double reach_px,
                                             double max_off_middle) const {
    const Matrix2 pixel_from_plane = d_plane_d_pixel_.inverse();
    Eigen::AlignedBox2d strip;
    for (const double out : {-reach_px, reach_px}) {
      for (const double off : {-max_off_middle, max_off_middle}) {
        Eigen::Vector2d u;
        u[axis] = sign * (1 + out / half_px);
        u[1 - axis] = off;
        strip.extend(center_px_ +
                     pixel_from_plane * (outline_.plane_point_from_unit(u) - start_center_));
      }
    }
    if (strip.isEmpty() || !(strip.sizes().maxCoeff() < lines_.width + lines_.height))
      return std::nullopt;
    return intersect_boxes(
        {static_cast<int>(strip.min().x()), static_cast<int>(strip.min().y()),
         static_cast<int>(strip.sizes().x()) + 2, static_cast<int>(strip.sizes().y()) + 2},
        box_);
  }

  /// Estimates the displacement of a side by the likelihood of the pixels near its middle: the
  /// level inside is that of the scanlines whole periods away. Returns std::nullopt if the side may
  /// be further away than these.
  std::optional<SideOffset> estimate_side_offset(int axis, int sign) const {
    constexpr double max_off_middle = 0.6, spare_px = 4, step_px = 0.2, model_error = 0.03,
                     slope_sd = 0.02;
    constexpr double max_square = 60, max_weight_at_end = 0.01;
    const double half_px = px_per_unit_ / outline_.unit_from_plane.row(axis).norm();
    const double reach_px = period_lines_ + spare_px;
    const auto box = find_box_near_side(axis, sign, half_px, reach_px, max_off_middle);
    if (!box) return std::nullopt;
    const auto num_steps = std::lround(reach_px / step_px);
    const auto make_offsets = [&](Eigen::Index n) {
      return Eigen::ArrayXd::LinSpaced(2 * n + 1, -double(n) * step_px, double(n) * step_px).eval();
    };
    const Eigen::ArrayXd offsets_px = make_offsets(num_steps),
                         coverages =
                             (make_offsets(2 * num_steps) / blur_px_).unaryExpr([](double z) {
                               return std::erfc(-z / std::numbers::sqrt2) / 2;
                             });
    Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(offsets_px.size());
    const double bright_level = bright_level_ - background_.level, halo = compute_halo();
    for (int line = box->y; line < box->end_row(); ++line) {
      const PlanePatch::Row row(patch_, line);
      const auto index = 2 * std::size_t(line - box_.y);
      const auto [left, left_sd] = predict_level_inside(index);
      const auto [right, right_sd] = predict_level_inside(index + 1);
      const double level = std::max(left, right) - background_.level,
                   level_sd = left > right ? left_sd : right_sd;
      if (!(level_sd > 0)) continue;
      // Sums of residuals without the level's error, and of the coverage.
      Eigen::ArrayXd square_sum = Eigen::ArrayXd::Zero(offsets_px.size()), product = square_sum,
                     coverage_square = square_sum;
      for (int column = box->x; column < box->end_column(); ++column) {
        const Eigen::Vector2d u = outline_.unit_from_plane_point(row.at_column(column).at);
        const double out_px = (sign * u[axis] - 1) * half_px;
        if (!(std::abs(u[1 - axis]) < max_off_middle && std::abs(out_px) < reach_px)) continue;
        const double error =
            model_error * bright_level + std::max(halo / 2, slope_sd * bright_level * -out_px);
        const double measured = lines_.gray_level_at_pixel(column, line) - background_.level;
        const double weight =
            1 / (square(error) +
                 double(predict_variance(static_cast<float>(measured + background_.level))));
        const auto coverage =
            coverages.segment(num_steps - std::lround(out_px / step_px), offsets_px.size());
        const Eigen::ArrayXd residual = measured - halo / 2 - (level - halo / 2) * coverage;
        square_sum += weight * residual.square();
        product += weight * residual * coverage;
        coverage_square += weight * coverage.square();
      }
      squares += (square_sum - product.square() / (1 / square(level_sd) + coverage_square))
                     .min(max_square);
    }
    const Eigen::ArrayXd weights = (-0.5 * (squares - squares.minCoeff())).exp();
    const double sum = weights.sum();
    if (!(std::max(weights[0], weights[weights.size() - 1]) < max_weight_at_end))
      return std::nullopt;
    const double mean_px = (weights * offsets_px).sum() / sum;
    return SideOffset{mean_px, std::sqrt((weights * (offsets_px - mean_px).square()).sum() / sum +
                                         square(step_px) / 12)};
  }

  /// Computes the covariance from the products of the last round.
  std::optional<Fit> make_result() {
    constexpr double min_inflation = 1e-9;
    Matrix normal = products_.template topLeftCorner<kUnknowns, kUnknowns>();
    Vector gradient = products_.col(kUnknowns).template head<kUnknowns>();
    const Matrix free_normal = normal;
    const Vector free_gradient = gradient;
    add_priors(normal, gradient);
    int num_free = 0;
    for (int i = 0; i < kUnknowns; ++i) num_free += is_free(i) ? 1 : 0;
    const double inflation =
        std::max({min_inflation, squares_ / std::max(1.0, degrees_of_freedom_ - num_free),
                  estimate_inflation()});
    Matrix covariance = inflation * normal.inverse();
    if constexpr (is_rectangle) {
      if (!place_hidden_sides(covariance)) return std::nullopt;
    }
    const double variance_px2 = covariance.template topLeftCorner<2, 2>().trace() / 2;
    if (!std::isfinite(variance_px2)) return std::nullopt;
    if constexpr (is_rectangle) {
      // Terms of higher order of an unknown distortion.
      constexpr double higher_order_ratio = 0.15;
      const double square_sum_px2 =
          outline_.unit_from_plane.rowwise().squaredNorm().cwiseInverse().sum();
      const double distortion_sd_px = higher_order_ratio * priors_.distortion_sd *
                                      outline_.off_axis.norm() * square_sum_px2 / 2;
      return RectangleFit{
          outline_,         std::hypot(std::sqrt(variance_px2), distortion_sd_px),
          radius_px_,       blur_px_,
          inlier_fraction_, covariance.template topLeftCorner<kGeometry, kGeometry>()};
    } else {
      OutlineFit fit{
          outline_, std::sqrt(variance_px2), radius_px_, blur_px_, inlier_fraction_, 0, 0, {}, {}};
      // Eliminates blur and tone, with their priors; the ovality has none.
      constexpr int eliminated = kUnknowns - kGeometry;
      normal = free_normal;
      gradient = free_gradient;
      normal(kLogBlur, kLogBlur) += 1 / (kLogBlurSd * kLogBlurSd);
      normal(kTone, kTone) += 1 / (kToneSd * kToneSd);
      add_size_prior(normal, gradient);
      const Eigen::Matrix<double, kGeometry, eliminated> gain =
          normal.template topRightCorner<kGeometry, eliminated>() *
          normal.template bottomRightCorner<eliminated, eliminated>().inverse();
      const double square = radius_px_ * radius_px_ / inflation;
      fit.matrix = square * (normal.template topLeftCorner<kGeometry, kGeometry>() -
                             gain * normal.template bottomLeftCorner<eliminated, kGeometry>());
      fit.gradient =
          square / radius_px_ *
          (gradient.template head<kGeometry>() - gain * gradient.template tail<eliminated>());
      return fit;
    }
  }

  const ImageView& lines_;
  const PlanePatch& patch_;
  PixelBox box_;
  Eigen::Vector2d start_center_;
  Outline outline_;
  double period_lines_;
  const Background& background_;
  Eigen::Vector2d center_px_;
  Priors priors_;
  Matrix2 d_plane_d_pixel_;
  double px_per_unit_;
  double radius_px_ = 0, blur_px_ = kBlur_px, tone_ = is_rectangle ? 0 : kMeanTone,
         bright_level_ = 1, variance_per_level_ = 0.1;
  /// Half width of the band, and changes of the outline since its pixels were selected.
  double start_radius_px_ = 0;
  bool is_first_round_ = true;
  double reach_px_ = 0, moved_px_ = 0, size_change_px_ = 0;
  double band_ = 1;  ///< factor of the half width
  bool is_coarse_ = true;
  // Pixels of the band, cell by cell: level, position in the plane relative to the first center,
  // pixels per unit of the distance from the center in radii, and derivatives of the depth.
  std::vector<float> levels_, plane_x_, plane_y_, scales_px_;
  /// Outward normals of the sides of a rectangle, normalized, and its bends.
  std::vector<float> side_x_, side_y_, bend_x_, bend_y_, columns_;
  double level_slope_ = 0;  ///< relative change of the level inside per column
  std::vector<Geometry> d_depths_;
  double selection_radius_px_ = 1;  ///< radius to which scales_px_ belongs
  std::vector<Cell> cells_;
  // Values of each sample in one round.
  Eigen::ArrayXf depths_px_, ratio_, power_, sign_, z_, density_, t_, coverage_, coded_, d_tone_,
      d_z_;
  std::vector<float> weights_;  // weights of the samples of one cell
  Eigen::Matrix<double, kUnknowns + 1, kUnknowns + 1> products_;
  double squares_ = 0, degrees_of_freedom_ = 0, inlier_fraction_ = 0, min_contrast_ = 0;
};

/// Returns the box of the pixels that may be near an outline, of which `center_px` is the image of
/// the center; an empty box if the lens does not cover the outline.
PixelBox compute_outline_box(const PlaneEllipse& outline, const Eigen::Vector2d& center_px,
                             double margin_px, const ImageSize& size, const LightShape& shape) {
  constexpr double margin = 1.2;
  const Matrix2 rim_from_circle = outline.unit_from_plane.inverse();
  Eigen::Vector2d low = center_px, high = center_px;
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi / 8 * i;
    const auto rim = shape.pixel_from_plane(
        outline.center + rim_from_circle * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    if (!rim) return {};
    low = low.cwiseMin(shape.swap_axes(*rim));
    high = high.cwiseMax(shape.swap_axes(*rim));
  }
  const Eigen::Vector2d middle = (low + high) / 2,
                        half = margin * (high - low) / 2 + Eigen::Vector2d::Constant(margin_px);
  if (!half.allFinite() || half.maxCoeff() > size.width + size.height) return {};
  const int x = static_cast<int>(std::floor(middle.x() - half.x())),
            y = static_cast<int>(std::floor(middle.y() - half.y()));
  return intersect_boxes(
      {x, y, static_cast<int>(2 * half.x()) + 2, static_cast<int>(2 * half.y()) + 2},
      {0, 0, size.width, size.height});
}

}  // namespace

void OutlineFit::add_center_error(double sd_px) {
  const double total_px = std::hypot(center_sd_px, sd_px);
  const double ratio = std::pow(center_sd_px / total_px, 2);
  center_sd_px = total_px;
  matrix *= ratio;
  gradient *= ratio;
}

bool KnownRadius::is_radius_of(const MeasuredLight& light) const {
  constexpr double max_sds = 2, max_rim_error = 0.02, max_edge_error = 0.03;
  return std::abs(std::log(light.plane_outline.radius() / radius)) <
         max_sds * log_sd +
             (light.outline_kind == LightOutline::rim ? max_rim_error : max_edge_error);
}

bool KnownRadius::improves_fit(const MeasuredLight& light) const {
  constexpr double min_fraction = 0.1, max_sds = 2;
  if (!light.outline_equations) return false;
  if (light.outline_kind == LightOutline::rim) return true;
  const Eigen::Matrix3d covariance =
      light.outline_equations->matrix.topLeftCorner<3, 3>().inverse();
  const double center_variance = covariance.topLeftCorner<2, 2>().trace();
  const double size_variance = covariance(kSize, kSize) + log_sd * log_sd;
  const double change = std::log(radius / light.plane_outline.radius());
  const double gain = covariance.col(kSize).head<2>().squaredNorm() / size_variance;
  return change * change > max_sds * max_sds * size_variance ||
         gain * change * change > min_fraction * min_fraction * center_variance * size_variance ||
         gain > min_fraction * center_variance;
}

namespace {

/// Fits an outline; `around` is an ellipse around it.
template <typename Shape>
std::optional<typename Shape::Fit> fit_outline(const ImageView& lines,
                                               const typename Shape::Outline& start,
                                               const PlaneEllipse& around, double start_blur_px,
                                               double period_lines, const Background& background,
                                               const LightShape& shape, const Priors& priors) {
  constexpr double min_margin_px = 6, margin_blurs = 3.5;
  constexpr int min_size_px = 8;
  const auto center = shape.pixel_from_plane(start.center);
  if (!center) return std::nullopt;
  const Eigen::Vector2d center_px = shape.swap_axes(*center);
  const PixelBox box =
      compute_outline_box(around, center_px, std::max(min_margin_px, margin_blurs * start_blur_px),
                          lines.size(), shape);
  if (std::min(box.width, box.height) < min_size_px) return std::nullopt;
  const auto patch = PlanePatch::fit(shape, box);
  if (!patch) return std::nullopt;
  OutlineFitter<Shape> fitter(lines, *patch, box, start, period_lines, background, center_px,
                              priors);
  return fitter.run(start_blur_px);
}

}  // namespace

std::optional<OutlineFit> fit_disc_outline(const ImageView& lines, const PlaneEllipse& start,
                                           double start_blur_px, double period_lines,
                                           const Background& background, const LightShape& shape,
                                           const std::optional<KnownRadius>& known_radius) {
  return fit_outline<Disc>(lines, start, start, start_blur_px, period_lines, background, shape,
                           {shape.has_known_lens(), known_radius});
}

std::optional<RectangleFit> fit_rectangle_outline(const ImageView& lines, const PlaneEllipse& start,
                                                  double start_blur_px, double period_lines,
                                                  const Background& background,
                                                  const LightShape& shape,
                                                  std::span<const Eigen::Vector2d> sizes_m) {
  // Standard deviations of the tilt and of its effect on opposite sides, and those without a lens.
  constexpr double lean_ratio = 1.5, no_lens_sd = 0.2;
  const PlaneEllipse around{start.center, start.unit_from_plane / std::numbers::sqrt2};
  const Eigen::Vector2d middle((lines.width - 1) / 2.0, (lines.height - 1) / 2.0),
      half_sides = start.unit_from_plane.rowwise().norm().cwiseInverse();
  PlaneRectangle rectangle{start};
  Priors priors;
  if (shape.has_known_lens()) {
    priors.shear_sd = get_tilt_sd(shape);
    priors.keystone_sd = lean_ratio * priors.shear_sd * half_sides;
    priors.sizes_m = sizes_m;
  } else {
    const double focal_px = middle.norm();
    rectangle.off_axis = start.center - shape.swap_axes(middle);
    priors.shear_sd = no_lens_sd;
    priors.keystone_sd = no_lens_sd / focal_px * half_sides;
    priors.distortion_sd = 1 / (3 * focal_px * focal_px);
  }
  rectangle.start = start.center;
  return fit_outline<Rectangle>(lines, rectangle, around, start_blur_px, period_lines, background,
                                shape, priors);
}

double get_tilt_sd(const LightShape& shape) {
  return shape.is_camera_tilted() ? kUnknownTiltSd / 30 : kUnknownTiltSd;
}

double PlaneRectangle::aspect() const {
  return unit_from_plane.row(1).norm() / unit_from_plane.row(0).norm();
}

double PlaneRectangle::shear() const {
  return -unit_from_plane.row(0).dot(unit_from_plane.row(1)) /
         (unit_from_plane.row(0).norm() * unit_from_plane.row(1).norm());
}

Eigen::Vector2d PlaneRectangle::compute_bend(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d from_start = point - start;
  const double square = from_start.squaredNorm();
  return square * off_axis + (2 * off_axis.dot(from_start) + square) * from_start;
}

double PlaneRectangle::compute_nonlinearity() const {
  const double half_px = 1 / unit_from_plane.rowwise().norm().minCoeff();
  return 2 * keystone.norm() + std::abs(distortion) * unit_from_plane.norm() *
                                   (3 * off_axis.norm() + half_px) * half_px * half_px;
}

Eigen::Vector2d PlaneRectangle::unit_from_plane_point(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d u = unit_from_plane * (point + distortion * compute_bend(point) - center);
  return u / (1 + keystone.dot(u));
}

Eigen::Vector2d PlaneRectangle::plane_point_from_unit(const Eigen::Vector2d& unit) const {
  const Eigen::Vector2d straight =
      center + unit_from_plane.inverse() * unit / (1 - keystone.dot(unit));
  Eigen::Vector2d point = straight;
  for (int i = 0; i < 3; ++i) point = straight - distortion * compute_bend(point);
  return point;
}

bool set_fitted_outline(OutlineFit fit, const LightShape& shape, MeasuredLight& light) {
  constexpr double rim_error = 0.0005, min_unevenness = 0.03;  // in radii; of rims with this error
  if (light.has_bright_core || fit.unevenness > min_unevenness)
    fit.add_center_error(rim_error * fit.radius_px);
  if (!shape.set_outline(fit.outline, fit.radius_px, light)) return false;
  light.outline_kind = light.has_bright_core || fit.unevenness > kMinUnevenness
                           ? LightOutline::rim
                           : LightOutline::edge;
  light.inlier_fraction = fit.inlier_fraction;
  light.rise_px = kRisePerBlur * fit.blur_px;
  light.sigma_px = std::clamp(fit.center_sd_px, kMinSigma_px, kMaxSigma_px);
  if (shape.has_known_lens()) {
    const Circle circle{fit.outline.center, fit.outline.radius()};
    light.outline_equations = {circle, fit.matrix, fit.gradient,
                               shape.compute_scanline_gradient(circle)};
  }
  return true;
}

}  // namespace vlp
